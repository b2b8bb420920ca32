"""Drawings of designs, parts, curves and tests."""
