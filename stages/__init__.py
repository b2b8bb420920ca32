"""One module per stage: settings in, typed result out. Stages neither open files nor print.

Settings, versions and signatures are needed by every command, the numerics only by a stage that runs: they are
imported inside the functions that compute, so that reading a case does not take seconds.
"""
