"""Figures for Python: every function returns a figure of matplotlib's; none is written.

``figure.savefig`` writes one, and so does :func:`save`, as small as the program's own. Those of a design, as
:func:`poro.optimize` and :func:`poro.load` give it, stand in :data:`FIGURES`, from which ``poro plot`` and
``poro report`` draw: ``FIGURES.register("mine", DesignFigure(draw, title, caption))`` adds another one.
"""

from __future__ import annotations

from pipeline.figures.arm import arm
from pipeline.figures.comparison import comparison
from pipeline.figures.designs import FIGURES, DesignFigure
from pipeline.figures.fit import fit
from pipeline.figures.history import history
from pipeline.figures.inflation import inflation
from pipeline.figures.initial import initial
from pipeline.figures.layers import layers
from pipeline.figures.part import part
from pipeline.figures.response import response
from pipeline.figures.saving import save
from pipeline.figures.section import section
from pipeline.figures.sweep import sweep
from pipeline.figures.views import views

__all__ = [
    "FIGURES",
    "DesignFigure",
    "arm",
    "comparison",
    "fit",
    "history",
    "inflation",
    "initial",
    "layers",
    "part",
    "response",
    "save",
    "section",
    "sweep",
    "views",
]
