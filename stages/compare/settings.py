"""Settings of a comparison."""

from __future__ import annotations

from pydantic import Field

from stages.settings import Section
from stages.words import Sensor, Zero


class Settings(Section):
    """How a recording is aligned and compared."""

    target: float | None = Field(
        None, gt=0, description="pressure at which deviations are reported; p_in if not given [kPa]"
    )
    zero: Zero = Field("rest", description="zero of both signals: median at rest, of the first rows, or as recorded")
    sensor: Sensor = Field("auto", description="what the displacement's signal does as the pressure rises")
    pressure_sensor: Sensor = Field("auto", description="what the pressure's signal does as the pressure rises")
    smoothing: float = Field(
        0.02, gt=0, le=0.2, description="half width of the regression's window over the largest common pressure [-]"
    )
    lag: float = Field(0.0, ge=-60, le=60, description="by which the displacement's signal is late [s]")
