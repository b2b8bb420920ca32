"""Recorded tests: reading them, fitting laws to them, comparing them with a prediction."""
