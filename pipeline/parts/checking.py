"""``poro check``: read a solid, make the checks of :mod:`stages.check`, and tell what they found."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from actuator.failure import Failure
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.results.json_output import result_json
from pipeline.store.atomic import write_bytes
from pipeline.store.files import detail_of, make_folder
from pipeline.store.solid_file import read_solid
from pipeline.terminal import Verdict, painted
from stages import check
from stages.words import Unit

#: What is neither good nor bad has none.
_COLOUR: dict[str, Verdict] = {"pass": "pass", "warn": "warn", "fail": "fail"}


@dataclass(frozen=True)
class CheckReport:
    """What was found in a file.

    Attributes:
        part: the file as the user named it.
        sha256: of its bytes, so that a report of an older file is recognised.
        unit: of the file, if the user said it.
        settings: of the checks.
        result: of the checks.
    """

    part: Path
    sha256: str
    unit: Unit | None
    settings: check.Settings
    result: check.Result

    @property
    def path(self) -> Path:
        """Where the report is stored: among the details of the part."""
        return detail_of(self.part, f"{self.part.name}.check.json")

    def as_text(self) -> str:
        """A table, one check a line."""
        size = " x ".join(f"{length:.2f}" for length in self.result.size)
        rows = [
            f"  {painted(f'{found.verdict:<15}', _COLOUR.get(found.verdict))} {found.name.value:<16} {found.text}"
            for found in self.result.findings
        ]
        head = f"{self.part}: {self.result.triangles} triangles, {size} mm"
        return "\n".join([head, *rows, f"  {self.result.summary}"])

    def as_json(self, *, stored: bool = True) -> str:
        """Everything, for other programs; it names the report's file if that is stored."""
        found = {
            "part": str(self.part),
            "sha256": self.sha256,
            "unit": self.unit,
            "passed": self.result.passed,
            "summary": self.result.summary,
            "triangles": self.result.triangles,
            "size": self.result.size,
            "settings": self.settings.model_dump(mode="json"),
            "findings": [asdict(finding) for finding in self.result.findings],
        }
        return result_json("check", found, [self.path] if stored else [])

    def write(self) -> None:
        """Store the report.

        Raises:
            OSError: if the folder or the disk does not take it.
        """
        make_folder(self.path.parent)
        write_bytes(self.path, f"{self.as_json()}\n".encode())

    def refuse(self) -> None:
        """Do nothing if the part passed.

        Raises:
            Fault: if a check failed (BAD_SOLID).
        """
        if not self.result.passed:
            raise Fault(ExitCode.BAD_SOLID, f"{self.part} fails: {', '.join(self.result.failed)}.")


def examine(part: Path, options: dict[str, Any], unit: Unit | None = None) -> CheckReport:
    """Read a file and make all checks.

    Args:
        part: STL or 3MF; its ending says which.
        options: values of :class:`stages.check.Settings` by name; those that are None keep their default.
        unit: of a file that does not say its own.

    Raises:
        Fault: if an option is out of range or the ending unknown (USAGE), the file is missing or unreadable
            (ARTIFACT), or its unit is doubtful (BAD_SOLID).
    """
    settings = option_settings(check.Settings, options)
    solid = read_solid(part, unit)
    try:
        result = check.run(solid.vertices, solid.triangles, settings)
    except Failure as failure:
        raise Fault(ExitCode.ARTIFACT, f"{part}: {failure}") from None
    return CheckReport(part, solid.sha256, unit, settings, result)
