"""Words that keys of settings and options of commands take; apart, so that the command line loads no stage."""

from typing import Literal

#: Where the zero of recorded signals is taken from.
Zero = Literal["rest", "first", "none"]
#: What the displacement's signal does as the pressure rises.
Sensor = Literal["auto", "rises", "falls"]
