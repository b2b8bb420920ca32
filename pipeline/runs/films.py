"""What ``poro film`` does: find the states of a case, and have them drawn one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from PIL import Image

from actuator.arrays import Floats
from pipeline.case.mesh_file import with_mesh
from pipeline.case.model import stored_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures.film import Film, Moment, frames
from pipeline.figures.film_file import FilmFormat, refuse_without_encoder, write_film
from pipeline.figures.inflated import grid_of, strain_scale
from pipeline.figures.offscreen import Scale
from pipeline.figures.states import solid_of
from pipeline.figures.views import PRESSURE
from pipeline.results.inflation import Inflated, part_name, read_inflation, read_path
from pipeline.results.json_output import result_json
from pipeline.results.simulation import read_fields, rig_units
from pipeline.runs import updates
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job, open_shown
from pipeline.runs.progress import displayed
from pipeline.store import artifact
from pipeline.store.files import make_folder
from pipeline.terminal import told
from stages.rig import RigUnits

FilmOf = Literal["updates", "simulation", "inflation"]
#: The stage whose artifact holds what a film is of.
STAGE: Mapping[FilmOf, str] = {"updates": "optimize", "simulation": "simulate", "inflation": "inflate"}
#: Frames of a film from zero to the largest pressure, and most frames of one of design updates.
ALONG, MOST = 40, 120
#: How often a line says how far it is, frames.
SAID = 10


def film(
    argument: Path,
    of: FilmOf | None,
    output: Path | None,
    format: FilmFormat,
    rate: float,
    width: int,
    *,
    as_json: bool = False,
) -> str:
    """Make a film; returns the name of its file, as text or as JSON.

    Args:
        argument: a case file, the artifact of a stage, or a part.
        of: what it is to show; by default what the artifact holds, of a part its inflation, else the design updates.
        output: folder of the film.
        format: of the file.
        rate: frames a second.
        width: of the frames, pixels.
        as_json: whether JSON is returned.

    Raises:
        Fault: if the states are not there (ARTIFACT), or an option does not fit (USAGE).
        OSError: if the folder or the disk does not take the film.
    """
    refuse_without_encoder(format)
    of, path, job, folder = _source(argument, of, output)
    if of == "updates":
        assert job is not None
        shown, name = _of_updates(job), job.case.name
    elif of == "simulation":
        shown, name = _of_simulation(path), path.name.removesuffix(".simulation.h5")
    else:
        shown, name = _of_inflation(path), part_name(path)
    folder = folder or (job.files.details if job else path.parent)
    make_folder(folder)
    target = folder / f"{name}.{of}.{format}"
    number = write_film(_told(frames(shown, width), len(shown.moments)), target, format, rate)
    if as_json:
        return result_json("film", {"name": name, "of": of, "frames": number}, [target])
    return told(f"{target}\n{number} frames", [target])


def _source(argument: Path, of: FilmOf | None, output: Path | None) -> tuple[FilmOf, Path, Job | None, Path | None]:
    """What a film is of, the artifact that holds it, the job unless that was given, and the folder if one was named."""
    if argument.suffix == ".h5":
        stage = artifact.read_header(argument).stage
        held = next((name for name in STAGE if STAGE[name] == stage), None)
        if held in ("simulation", "inflation"):
            if of not in (held, None):
                sentence = f"{argument}: this is the result of '{stage}'; give the case file, or leave --of {of} out."
                raise Fault(ExitCode.USAGE, sentence)
            return held, argument, None, output
    job, folder = open_shown(argument, output)
    of = of or ("inflation" if is_solid(argument) else "updates")
    return of, job.artifact(STAGE[of]), job, folder


def _told(images: Iterable[Image.Image], total: int) -> Iterator[Image.Image]:
    """The frames, while the user is shown how many there are yet."""
    with displayed("frames") as display:
        for number, image in enumerate(images, start=1):
            if number % SAID == 0 or number == total:
                display.line(f"frame {number} of {total}")
            display.progress(number, total, "")
            yield image


# ------------------------------------------------------------------------------------------------ what is shown


def _of_updates(job: Job) -> Film:
    kept = updates.kept(job)
    if not kept:
        sentence = f"{job.artifact('optimize')}: keeps no design updates"
        raise Fault(ExitCode.ARTIFACT, f"{sentence}; set optimizer.keep_updates: 1 and run `poro optimize` again.")
    numbers = sorted(kept)
    last = numbers[-1]
    numbers = [*numbers[:: -(-len(numbers) // MOST)]]
    numbers += [last] if numbers[-1] != last else []
    domain, pressure_in = job.case.domain.build(), job.case.optimize.parameters()[1].pressure or 1.0

    def grid(number: int) -> Any:
        fields = {name: np.asarray(values, dtype=np.float64) for name, values in kept[number].items()}
        return solid_of(
            domain, fields["chi"], pressure=fields["pressure"] / pressure_in, displacement=fields["displacement"]
        )

    moments = [Moment(f"design update {number} of {last}", partial(grid, number)) for number in numbers]
    return Film(job.case.name, moments, domain.mirrored, "pressure", PRESSURE)


def _of_simulation(path: Path) -> Film:
    case = with_mesh(stored_case(artifact.read_header(path).case_resolved, path), path, "")
    states = read_fields(path)
    domain, pressure_in = case.domain.build(), case.optimize.parameters()[1].pressure
    n = len(domain.points)
    rest = np.zeros((n, 3)), np.zeros(n)
    loads = np.array([0.0, *states.loads])
    moved = [rest[0], *(values[:n] for values in states.displacement)]
    pressure = [rest[1], *(values[:n] / pressure_in for values in states.pressure)]

    def grid(load: float) -> Any:
        here = partial(_between, load, loads)
        return solid_of(domain, states.chi[:n], pressure=here(pressure), displacement=here(moved))

    high = float(loads[-1])
    moments = [Moment(_words(load, load * pressure_in, rig_units(case)), partial(grid, load)) for load in _along(loads)]
    return Film(case.name, moments, domain.mirrored, "pressure", Scale(PRESSURE.colours, high, PRESSURE.label))


def _of_inflation(path: Path) -> Film:
    found, states = read_inflation(path), read_path(path)
    if not states:
        raise Fault(ExitCode.ARTIFACT, f"{path}: holds no state under pressure; run `poro inflate` again.")
    first = next(iter(states.values()))
    loads = np.array([0.0, *states])
    moved = [0.0 * first.displacement, *(state.displacement for state in states.values())]
    strain = [0.0 * first.strain, *(state.strain for state in states.values())]
    # Every point tells p_in but the first, which has no pressure.
    pressure_in = float(found.curves["pressure"][-1] / found.curves["load_factor"][-1])

    def grid(load: float) -> Any:
        here = partial(_between, load, loads)
        state = Inflated(first.points, first.cells, first.boundary, here(moved), here(strain), first.limit, first.half)
        return grid_of(state.scaled(found.summary["scale"]))

    moments = [Moment(_words(load, load * pressure_in, found.rig), partial(grid, load)) for load in _along(loads)]
    return Film(found.name, moments, first.half, "strain", strain_scale(first.limit), on_the_outside=True)


def _along(loads: Floats) -> list[float]:
    """Load factors of the frames, from zero to the largest, the stored ones among them."""
    return sorted({*np.linspace(0.0, loads[-1], ALONG).tolist(), *loads.tolist()})


def _between(load: float, loads: Floats, values: list[Floats]) -> Floats:
    """A field between the stored states, linear in the load."""
    k = int(np.clip(np.searchsorted(loads, load), 1, len(loads) - 1))
    share = (load - loads[k - 1]) / (loads[k] - loads[k - 1])
    return (1.0 - share) * values[k - 1] + share * values[k]


def _words(load: float, pressure: float, rig: RigUnits | None) -> str:
    if rig:
        scaled, _ = rig.scaled(np.array(pressure), np.array(0.0))
        return f"p / p_in = {load:.2f}, {float(scaled):.1f} kPa on the part"
    return f"p / p_in = {load:.2f}, {pressure:.4f} N/mm²"
