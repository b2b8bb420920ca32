"""The ersatz material: density, stiffness, permeability, drainage, and the hyperelastic laws of the solid."""
