"""Words that keys of settings and options of commands take; apart, so that the command line loads no stage."""

from typing import Literal

#: Curves that a recorded test is compared with: of the part as printed, and of the simulated density field.
PredictionName = Literal["as-printed", "density"]
#: Of lengths in a file that does not say it.
Unit = Literal["um", "mm", "cm", "m", "inch", "ft"]
#: Where the zero of recorded signals is taken from.
Zero = Literal["rest", "first", "none"]
#: What the displacement's signal does as the pressure rises.
Sensor = Literal["auto", "rises", "falls"]
