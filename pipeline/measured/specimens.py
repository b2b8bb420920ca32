"""Several tension tests of one material: what each says, their mean with its spread, and the law of the mean curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.fitting import FitReport
from pipeline.measured.uniaxial_test import LEAST_POINTS, UniaxialTest
from pipeline.results.json_output import result_json
from stages import fit
from stages.least_squares import NoFit


@dataclass(frozen=True)
class Specimens:
    """Fits to several files.

    Attributes:
        reports: one for each.
        mean: laws fitted to the mean of their curves, over the stretches that all of them have.
    """

    reports: tuple[FitReport, ...]
    mean: FitReport

    @classmethod
    def of(cls, reports: Sequence[FitReport], settings: fit.Settings) -> Specimens:
        """Average curves, and fit laws to the mean.

        Raises:
            Fault: if the curves have no stretches in common, or no law can be fitted to their mean (USAGE).
        """
        curves = [(each.result.stretch, each.result.stress) for each in reports]
        low, high = max(curve[0].min() for curve in curves), min(curve[0].max() for curve in curves)
        stretch = np.unique(np.concatenate([curve[0] for curve in curves]))
        stretch = stretch[(stretch >= low) & (stretch <= high)]
        names = ", ".join(str(each.source) for each in reports)
        if len(stretch) < LEAST_POINTS:
            raise Fault(ExitCode.USAGE, f"{names}: the tests have no stretches in common; fit them apart.")
        stress = np.mean([np.interp(stretch, *curve) for curve in curves], axis=0)
        try:
            result = fit.run(stretch, stress, settings)
        except NoFit as failure:
            raise Fault(ExitCode.USAGE, f"mean of {names}: {failure}") from None
        test = UniaxialTest(stretch, stress, "N/mm²", list(range(1, len(stretch) + 1)), bare_strain=False)
        return cls(tuple(reports), FitReport(Path(f"mean of {len(reports)} tests"), test, result, None))

    @property
    def refusal(self) -> str | None:
        """Why no section is recommended; None if one is."""
        return self.mean.refusal

    @property
    def moduli(self) -> dict[str, list[float]]:
        """E of each law that was fitted to every specimen, by specimen, N/mm²."""
        found = [{each.name: each.youngs_modulus for each in report.result.fits} for report in self.reports]
        return {law: [one[law] for one in found] for law in found[0] if all(law in one for one in found)}

    def as_text(self) -> str:
        """What is doubtful about each test, the moduli with their spread, and the laws of the mean curve."""
        lines = []
        for report in self.reports:
            result = report.result
            said = [*report.test.remarks, *(f"warning: {sentence}" for sentence in result.warnings)]
            best = result.best.name if result.best else "none is good enough"
            lines.append(
                f"{report.source}: {len(report.test.stretch)} rows, E {result.youngs_modulus:.4g} N/mm² ({best})"
            )
            lines += [f"  {sentence}" for sentence in said]
        for law, values in self.moduli.items():
            mean, spread = np.mean(values), np.std(values, ddof=1)
            each = ", ".join(f"{value:.4g}" for value in values)
            lines.append(f"  {law:<14}E {mean:.4g} ± {spread:.2g} N/mm² ({each})")
        return "\n".join([*lines, self.mean.as_text()])

    def as_json(self) -> str:
        """Everything, for other programs; stresses in N/mm²."""
        moduli = {
            law: {"mean": float(np.mean(values)), "spread": float(np.std(values, ddof=1)), "specimens": values}
            for law, values in self.moduli.items()
        }
        found: dict[str, Any] = self.mean.numbers() | {
            "specimens": [report.numbers() for report in self.reports],
            "youngs_moduli": moduli,
        }
        return result_json("fit", found, [report.plot for report in self.reports if report.plot])
