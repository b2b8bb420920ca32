"""The part as printed: a body-fitted mesh of a solid, and its finite-strain equilibrium under air pressure."""
