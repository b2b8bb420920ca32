"""The figures of an optimised design: one registry, which ``poro plot`` and the report draw from.

Another program adds one by ``FIGURES.register(name, DesignFigure(draw, title, caption))``; it is then drawn as
``NAME.name.png`` by ``poro plot`` and stands in the report.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from matplotlib.figure import Figure
from PIL import Image

from actuator.failure import Failure
from actuator.registry import Registry
from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures.arm import arm
from pipeline.figures.history import history, history_table
from pipeline.figures.initial import initial
from pipeline.figures.offscreen import CannotDraw
from pipeline.figures.response import response
from pipeline.figures.saving import Drawn, encoded, labelled
from pipeline.figures.section import section
from pipeline.figures.views import views
from pipeline.results.design import OptimisedDesign
from pipeline.results.simulation import read_simulation, rig_units
from pipeline.store.atomic import write_bytes

Format = Literal["png", "svg", "pdf"]


@dataclass(frozen=True)
class DesignFigure:
    """A figure of a design.

    Attributes:
        draw: a figure of matplotlib's, or pixels, which are stored as PNG whatever the format; raises
            :class:`~pipeline.figures.offscreen.CannotDraw` or a :class:`~actuator.failure.Failure` where it cannot.
        title: in the report.
        caption: one sentence on what is shown.
        report_format: in the report; pixels there where lines are too many.
        table: the same as CSV, for ``NAME.name.csv``, if numbers are wanted too.
        of_simulation: whether it shows the simulation beside the design, and is drawn only where there is one.
        of_own_start: whether it shows the domain's own initial design, and is drawn only where a case begins with that.
    """

    draw: Callable[[OptimisedDesign], Drawn]
    title: str
    caption: str
    report_format: Format = "svg"
    table: Callable[[OptimisedDesign], str] | None = None
    of_simulation: bool = False
    of_own_start: bool = False


def _response(design: OptimisedDesign) -> Figure:
    """Displacement over pressure, from the simulation beside the design."""
    if not design.simulation:
        raise CannotDraw("There is no simulation beside the design; make it with `poro simulate`.")
    return response(read_simulation(design.simulation), rig_units(design.case), design.name)


#: In the order of the report.
FIGURES: Registry[DesignFigure] = Registry("figure")
FIGURES.register(
    "initial",
    DesignFigure(
        initial,
        "Initial design",
        "The design that the optimisation starts from (Appendix C of the paper): the solid in its domain, and "
        "its density in two sections with the outline ρ = 0.5 and the region of the pressure source.",
        of_own_start=True,
    ),
)
FIGURES.register(
    "views",
    DesignFigure(
        views,
        "Views",
        "The optimised design from the side, from the front and from above, and deformed, coloured by p / p_in.",
        "png",
    ),
)
FIGURES.register(
    "arm",
    DesignFigure(
        arm,
        "Support, arm and spring",
        "Side view under full pressure: the actuator between the support it is clamped to and the rigid arm, whose end "
        "the spring holds; dashed: without pressure.",
    ),
)
FIGURES.register(
    "section",
    DesignFigure(
        section,
        "Section",
        "The plane X2 = 0, undeformed and deformed, with the mesh: solid and air, coloured by p / p_in.",
        "png",
    ),
)
FIGURES.register(
    "history",
    DesignFigure(
        history,
        "Convergence",
        "Total objective C and main objective C0, and the terms that penalise the constraints, against the number of "
        "the design update.",
        table=history_table,
    ),
)
FIGURES.register(
    "pressure",
    DesignFigure(
        _response,
        "Pressure and displacement",
        "Simulated displacements over the pressure.",
        of_simulation=True,
    ),
)


def figures_of(design: OptimisedDesign) -> dict[str, DesignFigure]:
    """The figures that can be drawn of a design, by name."""
    return {
        name: figure
        for name, figure in FIGURES.items()
        if (design.simulation or not figure.of_simulation) and (design.case.initial.own or not figure.of_own_start)
    }


def drawn(design: OptimisedDesign, name: str, format: str) -> tuple[str, bytes]:
    """Draw one figure; returns its format and the bytes of its file.

    Args:
        design: the design.
        name: of the figure.
        format: ``png``, ``svg`` or ``pdf``; pixels are always PNG.

    Raises:
        CannotDraw: if it needs what this machine or the design does not have.
        actuator.failure.Failure: if there is no solid to draw.
        Fault: if a file beside the design is unreadable (ARTIFACT).
    """
    figure = labelled(FIGURES[name].draw(design), design.label)
    format = "png" if isinstance(figure, Image.Image) else format
    return format, encoded(figure, format, name)


def plot_design(
    design: OptimisedDesign, folder: Path, format: str = "png", only: Iterable[str] = ()
) -> tuple[list[Path], list[str]]:
    """Draw the figures of a design, and write the tables of those that have one.

    Args:
        design: the design.
        folder: where the files go; their names begin with the case's.
        format: ``png``, ``svg`` or ``pdf``; pixels are always PNG.
        only: names of the figures to draw; all that can be drawn if there are none.

    Returns:
        The files, and a sentence for each figure that could not be drawn.

    Raises:
        Fault: if there is no figure of a name (USAGE), or a file beside the design is unreadable (ARTIFACT).
        OSError: if the folder or the disk does not take a file.
    """
    names = list(only) or list(figures_of(design))
    for name in names:
        if name not in FIGURES:
            sentence = f"--only {name}: there is no such figure; choose one of {', '.join(FIGURES)}."
            raise Fault(ExitCode.USAGE, sentence)
    files, problems = [], []
    for name in names:
        path = folder / f"{design.name}.{name}.{format}"
        if table := FIGURES[name].table:
            files.append(path.with_suffix(".csv"))
            write_bytes(files[-1], table(design).encode())
        try:
            found, data = drawn(design, name, format)
        except (Failure, CannotDraw) as failure:
            problems.append(f"{path}: not drawn: {failure}")
            continue
        files.append(path.with_suffix(f".{found}"))
        write_bytes(files[-1], data)
    return files, problems
