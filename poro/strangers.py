"""Files and packages of others that have the names of poro's own packages, and that Python would find first."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

OWN = ("actuator", "pipeline", "stages")
#: Exit code of the command: wrong usage, as in :mod:`pipeline.exit_codes`, which may be what is hidden.
USAGE = 2


def refuse() -> None:
    """Do nothing if Python finds poro's own packages; else end the command ``poro``, or refuse the import.

    Raises:
        ImportError: with a sentence that says what to rename.
        SystemExit: with the same sentence on standard error, if this process is the command.
    """
    for name in OWN:
        spec = find_spec(name)
        found = spec.origin if spec else None
        if found and Path(found).resolve() != Path(__file__).resolve().parents[1] / name / "__init__.py":
            sentence = f"{found} hides poro's own package '{name}'; rename it or start Python elsewhere."
            if _is_command():
                sys.stderr.write(f"poro: {sentence}\n")
                raise SystemExit(USAGE)
            raise ImportError(sentence)


def _is_command() -> bool:
    """Whether this process was started as ``poro`` or ``python -m poro``: there, nobody can catch an ImportError."""
    program = sys.argv[0] if sys.argv else ""
    # While Python looks for the module of -m, that is all it says of the program.
    return Path(program).stem == "poro" or (program == "-m" and "poro" in sys.orig_argv)
