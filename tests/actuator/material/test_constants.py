"""The tuple that kernels take: what it holds, and the names under which numba's cache finds its types again."""

from __future__ import annotations

import dataclasses
import importlib
import pickle
import sys
from pathlib import Path

import pytest
from physics import parameters

from actuator.material import constants
from actuator.material.constants import Constants, constants_of, constants_of_law, kernel_constants, law_file
from actuator.material.laws import yeoh
from actuator.material.laws.yeoh import Yeoh


def test_constants_of_model_and_law_stand_side_by_side() -> None:
    material, load, objective = parameters()
    c = constants_of(dataclasses.replace(material, law=Yeoh(0.2, 0.3)), load, objective)
    for name in Constants._fields[:8]:
        assert getattr(c, name) == getattr(material, name)
    assert c.pressure == load.pressure
    assert c.strain_energy_weight == objective.strain_energy_weight
    assert (c.energy_limit, c.energy_shift) == (objective.energy_limit, objective.energy_shift)
    assert c[len(Constants._fields) :] == (0.2, 0.3) == constants_of_law(Yeoh(0.2, 0.3))[len(Constants._fields) :]
    assert law_file(type(c)) is law_file(Yeoh) is yeoh


def test_type_is_found_again_by_its_name() -> None:
    kind = kernel_constants(Yeoh)
    assert pickle.loads(pickle.dumps(kind)) is kind


def law_of(folder: Path, text: str) -> type:
    """A law of another program, as its file is now."""
    (folder / "edited_law.py").write_text(
        f"from typing import NamedTuple\n\nclass Edited(NamedTuple):\n    c1: float\n\n{text}\n"
    )
    sys.modules.pop("edited_law", None)
    importlib.invalidate_caches()
    found: type = importlib.import_module("edited_law").Edited
    return found


def test_another_text_of_the_law_is_another_type(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels compiled from the old text are not taken for the new one; to forget them is not a fault."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    old = kernel_constants(law_of(tmp_path, "STIFFNESS = 1.0"))
    stored = pickle.dumps(old)
    new = kernel_constants(law_of(tmp_path, "STIFFNESS = 2.0"))
    assert new.__name__ != old.__name__
    monkeypatch.delattr(constants, old.__name__)
    found = pickle.loads(stored)
    assert found not in (old, new)
    assert pickle.loads(pickle.dumps(found)) is found
    with pytest.raises(AttributeError, match="has no attribute 'Constanst'"):
        _ = constants.Constanst
    sys.modules.pop("edited_law")


def test_coefficient_must_not_have_the_name_of_a_constant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    law = law_of(tmp_path, "")
    monkeypatch.setattr(law, "_fields", ("shear",))
    with pytest.raises(ValueError, match="shear"):
        kernel_constants(law)
