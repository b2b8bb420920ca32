"""Content keys: what a stage's result depends on, as one hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

import stages.optimize

#: Keys of ``optimizer`` that say what is kept beside the result, not what the result is.
RECORDED_ONLY = ("keep_updates",)
#: Keys of ``optimizer`` that say where on its path an optimisation ends, not which path it takes.
WHERE_IT_ENDS = ("max_updates", "stationarity", "least_gain")


def content_key(stage: str, version: int, settings: Mapping[str, Any], upstream: Sequence[str] = ()) -> str:
    """sha256 of the stage's name, version, settings in canonical JSON, and the keys of what it works on."""
    canonical = json.dumps(
        [stage, version, settings, list(upstream)], sort_keys=True, separators=(",", ":"), allow_nan=False
    )
    return hashlib.sha256(canonical.encode()).hexdigest()


def plain(settings: BaseModel) -> dict[str, Any]:
    """Settings as nested dictionaries of JSON values."""
    return settings.model_dump(mode="json")


def stage_settings(resolved: Mapping[str, Any], stage: str) -> dict[str, Any]:
    """The part of a resolved case that a stage sees."""
    if stage == "optimize":
        seen = {key: resolved[key] for key in stages.optimize.Settings.model_fields if key in resolved}
        return seen | {"optimizer": _without(seen.get("optimizer", {}), *RECORDED_ONLY)}
    if stage == "simulate":  # the thresholded field is made from the other two sections
        return {key: resolved.get(key, {}) for key in ("simulate", "refine", "mirror")}
    settings: dict[str, Any] = resolved.get(stage, {})
    return settings


def checkpoint_key(resolved: Mapping[str, Any], version: int) -> str:
    """Key of the path an optimisation takes: how far it is followed is left out, so that it can be continued.

    Args:
        resolved: a resolved case.
        version: of the stage ``optimize``.
    """
    path = stage_settings(resolved, "optimize")
    path["optimizer"] = _without(path["optimizer"], *WHERE_IT_ENDS)
    return content_key("checkpoint", version, path)


def _without(section: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {key: value for key, value in section.items() if key not in names}


def changes(stage: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """What differs between two settings of a stage, each as ``key old → new`` with the key of the case file."""
    section = "" if stage in ("optimize", "simulate") else f"{stage}."
    before, after = dict(_leaves(old, section)), dict(_leaves(new, section))
    return [
        f"{key} {before.get(key, 'unset')} → {after.get(key, 'unset')}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key) != after.get(key)
    ]


def _leaves(settings: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value
