"""In which groups the commands stand in ``--help``, in which order, and an example of each."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperCommand

from pipeline.cli.help import Command
from pipeline.cli.options import with_common

#: Stages of other programs stand here too.
STAGE_GROUP = "One stage of a case"
#: Heading -> command -> example.
GROUPS: dict[str, dict[str, str]] = {
    "From a case to a part": {
        "new": "poro new arm --like quick --set load.pressure_ratio=0.02",
        "run": "poro run quick.yaml --set mirror.threshold=0.1",
        "status": "poro status quick.yaml",
        "sweep": "poro sweep study.yaml --jobs 2",
        "clean": "poro clean quick.yaml",
        "schema": "poro schema > case.schema.json",
    },
    STAGE_GROUP: {
        "optimize": "poro optimize quick.yaml --updates 10",
        "refine": "poro refine quick.yaml",
        "finish": "poro finish quick.yaml --set finish.method=strain",
        "mirror": "poro mirror quick.yaml --set mirror.threshold=0.1",
        "export": "poro export quick.yaml --scale 1.5 --format 3mf",
        "simulate": "poro simulate quick.yaml --max-load 1.2",
        "inflate": "poro inflate part.stl --case quick.yaml",
    },
    "What results show": {
        "plot": "poro plot quick.yaml --only section",
        "film": "poro film quick.yaml --of inflation",
        "report": "poro report quick.yaml",
        "convert": "poro convert quick.h5 quick.vtu",
    },
    "Solids of any program": {
        "check": "poro check part.stl --direction x",
        "slice": "poro slice part.stl --layer 0.05",
    },
    "Measurements": {
        "fit": "poro fit tension.csv --law ogden",
        "compare": "poro compare quick.yaml measured.csv --scale 1.5 --youngs 0.3",
    },
}
_PLACES = {name: heading for heading, commands in GROUPS.items() for name in commands}


def arrange(app: typer.Typer) -> None:
    """Put the commands of a program into their groups, with their examples and the options that all have."""
    for found in app.registered_commands:
        assert found.callback is not None
        name = name_of(found)
        found.rich_help_panel = _PLACES.get(name, found.rich_help_panel)
        found.epilog = GROUPS.get(_PLACES.get(name, ""), {}).get(name, found.epilog)
        found.callback = with_common(found.callback)
        found.cls = Command if found.cls is TyperCommand or found.cls is None else found.cls
    order = {name: place for place, name in enumerate(_PLACES)}
    app.registered_commands.sort(key=lambda found: order.get(name_of(found), len(order)))


def name_of(command: Any) -> str:
    """What a registered command is called by."""
    return command.name or command.callback.__name__.replace("_", "-")
