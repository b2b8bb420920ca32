"""The terms of the objective, Eqs. (9) to (15): value, gradient and curvature of each."""
