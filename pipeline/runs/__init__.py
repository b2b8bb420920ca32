"""Running a case: what to do and why, doing it, showing it, resuming it."""
