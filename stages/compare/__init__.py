"""Stage ``compare``: a recorded test of a printed actuator against its prediction (Section 5 of the paper)."""

from stages.compare.comparison import Prediction, Recording, Result, Settings, run

__all__ = ["Prediction", "Recording", "Result", "Settings", "run"]
