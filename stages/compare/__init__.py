"""Stage ``compare``: a recorded test of a printed actuator against its prediction (Section 5 of the paper)."""

from stages.compare.alignment import Aligned, Recording, aligned
from stages.compare.comparison import Prediction, Result, run
from stages.compare.settings import Settings

__all__ = ["Aligned", "Prediction", "Recording", "Result", "Settings", "aligned", "run"]
