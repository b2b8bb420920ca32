"""Stage ``check``: whether a solid of any origin can be printed in SLA silicone and hold air as an actuator."""

from stages.check.checks import Result, air_chamber, run
from stages.check.settings import Settings
from stages.check.soundness import sound

__all__ = ["Result", "Settings", "air_chamber", "run", "sound"]
