"""`poro film`: frames that differ, read back by Pillow and ffmpeg, and a sentence where there is nothing to show."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import imageio_ffmpeg
import numpy as np
import pytest
from command_line import Poro
from PIL import Image

from actuator.arrays import Floats
from pipeline.exit_codes import ExitCode
from pipeline.figures import sheet
from pipeline.figures.offscreen import CannotDraw, Pixels, Shot
from pipeline.runs import films
from pipeline.runs.job import open_job


@pytest.fixture
def plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the process of VTK's, which starts for seconds."""

    def ended_badly(shots: Sequence[Shot], extents: Sequence[Floats], pixels_per_mm: float) -> list[Pixels]:
        raise CannotDraw("VTK cannot draw")

    monkeypatch.setattr(sheet, "pictures", ended_badly)


def read_gif(path: Path) -> tuple[list[np.ndarray], list[int]]:
    """Frames and how long each is shown, ms."""
    with Image.open(path) as film:
        frames, times = [], []
        for number in range(film.n_frames):
            film.seek(number)
            frames.append(np.asarray(film.convert("RGB")).astype(int))
            times.append(film.info["duration"])
    return frames, times


def test_updates_of_a_design_are_frames_of_one_size(poro: Poro, folder: Path) -> None:
    ended = poro("film", "tiny.yaml", "--output", ".", "--size", 400, "--fps", 5)
    assert ended.code == ExitCode.OK, ended.err
    assert ended.out.split() == ["tiny/details/tiny.updates.gif", "2", "frames"]
    assert "frame 2 of 2" in ended.err
    assert (folder / "tiny/details/tiny.updates.gif").stat().st_size < 200_000
    (first, last), times = read_gif(folder / "tiny/details/tiny.updates.gif")
    assert first.shape == last.shape
    assert first.shape[1] == 400
    assert times == [200, 1000]
    for frame in (first, last):
        halves = np.array_split((frame < 235).any(axis=2), 2, axis=1)
        assert [half.mean() > 0.05 for half in halves] == [True, True]
    changed = (np.abs(first - last).sum(axis=2) > 30).mean(axis=0)
    assert changed[:180].sum() > 0.0
    assert changed[370:].sum() == 0.0  # the colour bar stays


# imageio-ffmpeg leaves the pipes to its processes to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning", "ignore::ResourceWarning")
@pytest.mark.usefixtures("plainly")
def test_simulation_moves_up_to_its_largest_pressure(
    poro: Poro, folder: Path, simulation: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(films, "ALONG", 3)
    ended = poro("film", simulation.name, "--size", 401, "--json")
    assert ended.code == ExitCode.OK, ended.err
    found = json.loads(ended.out)
    # At 0, 0.5 and 1, and wherever else frames are.
    assert (found["of"], found["frames"], found["files"]) == ("simulation", 3, ["tiny/details/tiny.simulation.gif"])
    frames, _ = read_gif(folder / "tiny/details/tiny.simulation.gif")
    steps = [np.abs(frames[k] - frames[0]).sum() for k in (1, 2)]
    assert 0 < steps[0] < steps[1]
    again = poro("film", "tiny.h5", "--of", "simulation", "--size", 401, "--format", "mp4")
    assert again.code == ExitCode.OK, again.err
    number, seconds = imageio_ffmpeg.count_frames_and_secs("tiny/details/tiny.simulation.mp4")
    assert (number, seconds) == (3 + 10, pytest.approx(1.3))  # the last one is held for a second


@pytest.mark.usefixtures("plainly")
def test_updates_of_an_interrupted_optimisation_are_shown(poro: Poro, folder: Path) -> None:
    kept = films.updates.read(folder / "tiny/tiny.h5")
    job = open_job(folder / "tiny.yaml", folder)
    place = films.updates.Place(job.files.updates, films.updates.path_header(job, films.updates.STAGE))
    place.folder.mkdir()
    for number, fields in kept.items():
        datasets = {
            name: films.updates.Dataset(fields[name], *meaning) for name, meaning in films.updates.FIELDS.items()
        }
        films.artifact.write(place.file(number), place.header, datasets)
    (folder / "tiny/tiny.h5").unlink()
    ended = poro("film", "tiny.yaml", "--output", ".", "--size", 300)
    assert ended.code == ExitCode.OK, ended.err
    assert len(read_gif(folder / "tiny/details/tiny.updates.gif")[0]) == 2


@pytest.mark.usefixtures("plainly")
def test_quiet_names_the_file_alone(poro: Poro, folder: Path) -> None:
    ended = poro("film", "tiny.h5", "--size", 300, "-q")
    assert (ended.code, ended.out, ended.err) == (ExitCode.OK, "tiny/details/tiny.updates.gif\n", "")


def test_what_stops_a_film_leaves_nothing_half_written(
    poro: Poro, folder: Path, simulation: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = set(folder.iterdir())
    for arguments, code, words in (
        (["tiny.simulation.h5", "--of", "updates"], ExitCode.USAGE, "this is the result of 'simulate'"),
        (["tiny.h5", "--of", "inflation"], ExitCode.ARTIFACT, "tiny.inflation.h5: there is no such file"),
        (["tiny.h5", "--fps", "0"], ExitCode.USAGE, "--fps"),
        (["tiny.h5", "--of", "forces"], ExitCode.USAGE, "is not one of"),
    ):
        ended = poro("film", *arguments)
        assert (ended.code, words in ended.err) == (code, True), ended.err
    monkeypatch.setattr("pipeline.figures.film_file.find_spec", lambda name: None)
    ended = poro("film", "tiny.h5", "--format", "mp4")
    assert ended.code == ExitCode.USAGE
    assert "`pip install imageio-ffmpeg`" in ended.err

    def interrupted(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(sheet, "pictures", interrupted)
    assert poro("film", "tiny.h5").code == ExitCode.INTERRUPTED
    assert set(folder.iterdir()) == before
