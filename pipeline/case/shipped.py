"""The cases that come with the program; a module of its own, so that completion in a shell loads little."""

from __future__ import annotations

from pathlib import Path

#: Where they lie: beside the code where it is installed, and in a checkout.
FOLDERS = (Path(__file__).parents[1] / "configs", Path(__file__).parents[2] / "configs")


def shipped_case(name: str) -> Path | None:
    """The shipped case of a file name, if there is one."""
    return next((folder / name for folder in FOLDERS if (folder / name).is_file()), None)


def shipped_names() -> list[str]:
    """File names of all shipped cases."""
    return sorted({path.name for folder in FOLDERS for path in folder.glob("*.yaml")})
