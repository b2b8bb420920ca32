"""A shape of regions registered from outside the product: read from a case, kept by the optimisation, in the schema."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import Poro
from jsonschema import Draft202012Validator
from made_up_shape import RingRegion

from pipeline.case.model import case_schema
from pipeline.exit_codes import ExitCode
from pipeline.store import contents
from stages.regions import SHAPES

CASE = """\
domain: {core_cells: 4, rings: 2, layers: 6}
optimizer: {max_updates: 1}
regions:
  - {kind: void, shape: ring, place: 7.5, radius: 1 cm, thickness: 6.0}
"""


def test_a_shape_of_another_program_is_kept(poro: Poro) -> None:
    Path("ring.yaml").write_text(CASE)
    with SHAPES.registered("ring", RingRegion):
        Draft202012Validator(json.loads(case_schema())).validate(yaml.safe_load(CASE))
        ended = poro("optimize", "ring.yaml", "--threads", 1, "--output", ".")
        assert ended.code == ExitCode.OK, ended.err
        domain, chi = contents.design(Path("ring/ring.h5"), "optimize")
        depth = 3.0 - np.hypot(domain.points[:, 0] - 7.5, np.hypot(*domain.points[:, 1:].T) - 10.0)
        assert (depth > 0.5).sum() > 10
        assert (chi[depth > 0.5] < 0.0).all()
        assert (chi > 0.0).any()
    ended = poro("optimize", "ring.yaml", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert "ring.yaml:4: regions.0.shape: 'ring' is unknown" in ended.err


@pytest.mark.parametrize(
    "entry",
    [
        {"kind": "solid", "shape": "cylinder", "start": [0, 1, 2], "end": [0, 0, "2 cm"], "radius": "3 mm"},
        {"kind": "free", "shape": "skin", "surface": "tip", "thickness": 1.0},
        {"kind": "void", "shape": "file", "file": "a.stl"},
    ],
)
def test_the_schema_knows_the_shapes(entry: dict[str, object]) -> None:
    schema = Draft202012Validator(json.loads(case_schema()))
    schema.validate({"regions": [entry]})
    for wrong in ({**entry, "kind": "firm"}, {**entry, "size": 1.0}, {"kind": "void"}):
        assert list(schema.iter_errors({"regions": [wrong]}))
