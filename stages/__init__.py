"""One module per stage: settings in, typed result out. Stages neither open files nor print."""
