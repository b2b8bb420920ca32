"""Files on disk: artifacts, their seal and grids, tables, and where a job's files lie."""
