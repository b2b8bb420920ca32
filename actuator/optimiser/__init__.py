"""The optimiser: cheap terms solved exactly in an inner problem, the mechanics modelled by exact curvature."""
