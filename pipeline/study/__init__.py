"""Studies: a case with varied keys."""
