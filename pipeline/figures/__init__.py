"""Figures of designs, parts, curves and tests."""
