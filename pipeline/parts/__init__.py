"""Solids of any origin: reading, checking, slicing."""
