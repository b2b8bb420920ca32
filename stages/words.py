"""Words that keys of settings and options of commands take; apart, so that the command line loads no stage."""

from typing import Literal

#: Density fields that are simulated: the optimised one, and the solid that is exported as far as a mesh shows it.
FieldName = Literal["density", "thresholded"]
#: Where the zero of recorded signals is taken from.
Zero = Literal["rest", "first", "none"]
#: What the displacement's signal does as the pressure rises.
Sensor = Literal["auto", "rises", "falls"]
