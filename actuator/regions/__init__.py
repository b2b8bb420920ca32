"""Regions of the domain that stay void or solid: shapes, and the bounds on χ that they make."""
