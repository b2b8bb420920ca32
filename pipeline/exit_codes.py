"""How the program ends: the exit codes and the one exception that carries them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from actuator import failure

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

Settings = TypeVar("Settings", bound="BaseModel")


class ExitCode(IntEnum):
    """What the shell sees; documented in ``poro --help``."""

    meaning: str

    OK = 0, "ok"
    UNEXPECTED = 1, "unexpected error (details are in the log)"
    USAGE = 2, "wrong usage or case file"
    NOT_CONVERGED = 3, "did not converge"
    ARTIFACT = 4, "artifact missing, unreadable or stale"
    BAD_SOLID = 5, "the exported solid fails its checks"
    BUSY = 6, "another process is working on the case"
    UNSTABLE = 7, "done, but the design's state is not stable"
    INTERRUPTED = 130, "interrupted"

    def __new__(cls, value: int, meaning: str = "") -> Self:
        """A code with what it means in a few words."""
        code = int.__new__(cls, value)
        code._value_, code.meaning = value, meaning
        return code


class Fault(Exception):
    """An expected end of a command: ``str(fault)`` says what is wrong and what to change, one sentence per line."""

    def __init__(self, code: ExitCode, sentence: str) -> None:
        super().__init__(sentence)
        self.code = code


#: How a failure of the science ends a command; others did not converge.
_FAILURES = {
    failure.EmptySolid: ExitCode.BAD_SOLID,
    failure.NotManifold: ExitCode.BAD_SOLID,
    failure.LooseBodies: ExitCode.BAD_SOLID,
    failure.UnreadableSolid: ExitCode.BAD_SOLID,
    failure.InvalidField: ExitCode.ARTIFACT,
    failure.InvalidSettings: ExitCode.USAGE,
    failure.InvalidRegion: ExitCode.USAGE,
    failure.OutOfMemory: ExitCode.UNEXPECTED,
}


def code_of(error: failure.Failure) -> ExitCode:
    """The exit code for a failure of the science."""
    return _FAILURES.get(type(error), ExitCode.NOT_CONVERGED)


def shown(value: Any, most: int = 60) -> str:
    """Text of a file, fit for a message: on one line, no control characters, not too long."""
    text = str(value)
    text = text if text.isprintable() else ascii(text)[1:-1]
    return text if len(text) <= most else text[: most - 1] + "…"


def wrong_option(option: str, error: ValidationError) -> Fault:
    """The fault for a value of a command's option that its stage refuses."""
    detail = error.errors()[0]
    wrong = detail["msg"].replace("Input should be", "must be")
    return Fault(ExitCode.USAGE, f"{option}: {wrong}, not {detail['input']}; change the value.")


def option_settings(kind: type[Settings], options: Mapping[str, Any], option: str = "") -> Settings:
    """A stage's settings from the options of a command; those that are None keep their default.

    Args:
        kind: of the settings.
        options: values by the names of the settings.
        option: what a wrong value is blamed on; by default the option that is called as the setting is.

    Raises:
        Fault: if a value is refused (USAGE).
    """
    from pydantic import ValidationError  # slow to load: commands that need no settings do without

    try:
        return kind.model_validate({name: value for name, value in options.items() if value is not None})
    except ValidationError as error:
        setting = str(error.errors()[0]["loc"][0])
        raise wrong_option(option or f"--{setting.replace('_', '-')}", error) from None


def unexpected(error: Exception, log: Path | str) -> Fault:
    """The fault for an error nobody foresaw, whose traceback is in a log."""
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return Fault(ExitCode.UNEXPECTED, f"Unexpected error: {reason}; details are in {log}.")
