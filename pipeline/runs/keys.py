"""Content keys: what a stage's result depends on, as one hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from stages.chain import GOAL, STAGES, path_to


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
    """The part of a resolved case on which a stage's result depends, section by section."""
    row = STAGES[stage]
    idle = [key for key, other in row.only_with.items() if _at(resolved, other) is None]
    return _without(resolved, row.sections, row.recorded_only, idle)


def path_key(resolved: Mapping[str, Any], stage: str, version: int) -> str:
    """Key of the path a stage takes: how far it is followed is left out, so that it can be continued.

    Args:
        resolved: a resolved case.
        stage: a stage that can be continued.
        version: of the stage.
    """
    return content_key("checkpoint", version, _path_settings(resolved, stage))


def problem(resolved: Mapping[str, Any]) -> dict[str, Any]:
    """The problem that a resolved case poses, section by section: what decides which path its optimisation takes."""
    return _path_settings(resolved, path_to(GOAL)[0])


def _path_settings(resolved: Mapping[str, Any], stage: str) -> dict[str, Any]:
    row = STAGES[stage]
    return _without(resolved, row.sections, row.recorded_only + row.extent)


def _without(
    resolved: Mapping[str, Any], sections: Sequence[str], left_out: Sequence[str], idle: Sequence[str] = ()
) -> dict[str, Any]:
    """Sections without some keys, and with others unset; one that says nothing is left out, as before it was known."""

    def of(section: str, values: Mapping[str, Any]) -> dict[str, Any]:
        return {
            key: None if section in idle or f"{section}.{key}" in idle else value
            for key, value in values.items()
            if f"{section}.{key}" not in left_out
        }

    kept: dict[str, Any] = {}
    for section in (each for each in sections if each in resolved):
        values = resolved[section]
        if isinstance(values, list):  # of sections
            if values:
                kept[section] = [of(section, each) for each in values]
        elif not (found := of(section, values)) or any(value is not None for value in found.values()):
            kept[section] = found
    return kept


def _at(resolved: Mapping[str, Any], key: str) -> Any:
    section, _, name = key.partition(".")
    return resolved.get(section, {}).get(name)


def changes(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """What differs between two settings of a stage, each as ``key old → new`` with the key of the case file."""
    before, after = dict(leaves(old)), dict(leaves(new))
    return [
        f"{key} {before.get(key, 'unset')} → {after.get(key, 'unset')}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key) != after.get(key)
    ]


def leaves(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of nested settings."""
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            yield from leaves({str(number): each for number, each in enumerate(value)}, f"{prefix}{key}.")
        else:
            yield prefix + key, value
