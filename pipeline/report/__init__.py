"""The report: one HTML file with everything about a case."""
