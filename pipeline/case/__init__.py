"""Case files: reading, checking, writing."""
