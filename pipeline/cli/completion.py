"""What the shell offers where a case, an artifact or a law is due."""

from __future__ import annotations

from pathlib import Path

from pipeline.case.shipped import shipped_names

ENDINGS = (".yaml", ".yml", ".h5")
STUDY_ENDINGS = (".yaml", ".yml")


def cases(incomplete: str) -> list[str]:
    """Case files, artifacts and folders that begin as what is typed, and the shipped cases."""
    shipped = [name for name in shipped_names() if name.startswith(incomplete)]
    return sorted({*_files(incomplete, ENDINGS), *shipped})


def parts(incomplete: str) -> list[str]:
    """Solids beside what :func:`cases` offers."""
    from stages.formats import FORMATS

    solids = _files(incomplete, tuple(format.ending for format in FORMATS.values()))
    return sorted({*cases(incomplete), *solids})


def studies(incomplete: str) -> list[str]:
    """YAML files and folders that begin as what is typed."""
    return _files(incomplete, STUDY_ENDINGS)


def keys(incomplete: str) -> list[str]:
    """Dotted keys of the case file that begin as what is typed, with their equals sign."""
    from pipeline.case.model import case_type  # the settings: only where they are asked for

    sections = {name: field.annotation for name, field in case_type().model_fields.items()}
    found = [f"{name}.{key}=" for name, kind in sections.items() for key in getattr(kind, "model_fields", ())]
    return [key for key in ("name=", *found) if key.startswith(incomplete)]


def laws(incomplete: str) -> list[str]:
    """Material laws that ``poro fit`` knows and that begin as what is typed, and the word for all of them."""
    from stages.fit import ALL  # the settings: only where they are asked for
    from stages.laws import LAWS

    return [name for name in (ALL, *LAWS) if name.startswith(incomplete)]


def _files(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    folder, _, beginning = incomplete.rpartition("/")
    prefix = f"{folder}/" if "/" in incomplete else ""
    found = []
    try:
        entries = sorted(Path(prefix or ".").expanduser().iterdir())
    except OSError:
        return []
    for path in entries:
        if not path.name.startswith(beginning) or (path.name.startswith(".") and not beginning.startswith(".")):
            continue
        if path.is_dir():
            found.append(f"{prefix}{path.name}/")
        elif path.suffix in endings:
            found.append(f"{prefix}{path.name}")
    return found
