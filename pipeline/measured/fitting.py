"""``poro fit``: read a uniaxial test, fit the laws of :mod:`stages.fit`, and tell how well they do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from actuator.failure import Failure
from pipeline.case.messages import number_text
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.measured.uniaxial_test import UniaxialTest, read_uniaxial_test
from pipeline.results.json_output import result_json
from pipeline.runs.job import open_job
from stages import fit
from stages.least_squares import NoFit

#: Strain that half of the rows lie beyond if it is in percent: the softest elastomers break at 10 to 15.
PERCENT = 10.0
#: Young's modulus below which, with a strain without unit, percent is thought of, N/mm², for few elastomers are softer;
#: and the stretch beyond which that is said.
SOFT, FAR = 0.05, 3.0


@dataclass(frozen=True)
class FitReport:
    """Laws fitted to a file.

    Attributes:
        source: the CSV file.
        test: what is in it.
        result: of the fits.
        plot: the figure, if one was drawn.
    """

    source: Path
    test: UniaxialTest
    result: fit.Result
    plot: Path | None

    @property
    def refusal(self) -> str | None:
        """Why no section is recommended; None if one is."""
        if self.result.best:
            return None
        return (
            f"{self.source}: no law reaches R² {fit.LEAST_R_SQUARED:g}, so that none is recommended; look at the rows "
            "that scatter, or fit more of them, as with --up-to 2."
        )

    def as_text(self) -> str:
        """A table of the laws, what is doubtful about them, and the best one's section for a case file."""
        result, limit = self.result, 100.0 * self.result.strain_limit
        stretch = result.stretch[result.fitted]
        lines = [
            f"{self.source}: {len(self.test.stretch)} rows, {len(result.stretch)} of them a curve, "
            f"stretch {result.stretch.min():.5g} to {result.stretch.max():.5g}, stress in {self.test.unit}",
            *(f"  note: {sentence}" for sentence in self.test.remarks),
            *(f"  warning: {sentence}" for sentence in result.warnings),
            f"  fitted to {len(stretch)} rows, stretch {stretch.min():.5g} to {stretch.max():.5g}; errors up to the "
            f"strain limit of {limit:g} %",
        ]
        if result.start:
            stress = result.start.stress(1.0 + result.strain_limit)
            lines.append(
                f"  rows near rest: E {result.start.slope:.4g} N/mm², stress at {limit:g} % {stress:.4g} N/mm²"
            )
        at_limit = f"at {limit:g} %"
        heading = f"  {'law':<14}{'E [N/mm²]':>10}{'error':>9}{at_limit:>10}{'R²':>10}{'rms':>10}"
        lines.append(f"{heading}{'largest error [N/mm²]':>24}{'AICc':>9}")
        for found in result.fits:
            largest = f"{found.largest_error:.4g} at {found.largest_at:.3f}"
            aicc = "-" if found.aicc is None else f"{found.aicc:.1f}"
            lines.append(
                f"  {found.name:<14}{found.youngs_modulus:>10.4g}{_percent(found.modulus_error):>9}"
                f"{_percent(found.limit_error):>10}{found.r_squared:>10.5f}"
                f"{found.root_mean_square:>10.3g}{largest:>24}{aicc:>9}"
            )
            values = ", ".join(f"{key} {value:.5g} {unit}".rstrip() for key, (value, unit) in found.literature.items())
            lines.append(f"    {values}")
            lines += [f"    warning: {sentence}" for sentence in found.warnings]
        lines += [f"  {name}: not fitted. {sentence}" for name, sentence in result.left_out.items()]
        if self.plot:
            lines.append(f"  {self.plot}")
        if result.best:
            lines += [f"For a case file ({result.best.name}):", "", case_section(result.best)]
        return "\n".join(lines)

    def as_json(self) -> str:
        """Everything, for other programs; stresses in N/mm²."""
        return result_json("fit", self.numbers(), [self.plot] if self.plot else [])

    def numbers(self) -> dict[str, Any]:
        """Everything, by names."""
        result = self.result
        stretch = result.stretch[result.fitted]
        return {
            "source": str(self.source),
            "points": len(self.test.stretch),
            "stretch": [float(result.stretch.min()), float(result.stretch.max())],
            "unit": self.test.unit,
            "fitted": {"points": len(stretch), "stretch": [float(stretch.min()), float(stretch.max())]},
            "strain_limit": result.strain_limit,
            "near_rest": result.start
            and {
                "youngs_modulus": result.start.slope,
                "standard_deviation": result.start.uncertainty if isfinite(result.start.uncertainty) else None,
                "stress_at_limit": result.start.stress(1.0 + result.strain_limit),
            },
            "warnings": result.warnings,
            "best": result.best and result.best.name,
            "fits": [
                asdict(each)
                | {
                    "law": each.ratios,
                    "youngs_modulus": each.youngs_modulus,
                    "coefficients": each.coefficients,
                    "case": case_section(each),
                }
                for each in result.fits
            ],
            "left_out": result.left_out,
            "notes": self.test.remarks,
        }


def settings_of(options: dict[str, Any], case: Path | None) -> fit.Settings:
    """The settings of a fit, with the strain limit of a case if there is one.

    Raises:
        Fault: if an option or the case cannot be used.
    """
    if case:
        options = options | {"strain_limit": open_job(case, None).case.objective.strain_limit}
    return option_settings(fit.Settings, options)


def fit_file(
    path: Path, settings: fit.Settings, unit: str | None, specimen: Mapping[str, float | None], *, plot: bool
) -> FitReport:
    """Read a test, fit laws to it, and draw them beside it.

    Args:
        path: CSV; see :func:`pipeline.measured.uniaxial_test.read_uniaxial_test`.
        settings: of the fit.
        unit: of the stress if the header has none.
        specimen: its ``gauge_length``, mm, and ``area``, mm², if the file does not say.
        plot: whether to draw ``STEM.fit.png``.

    Raises:
        Fault: if the file cannot be used (ARTIFACT), or the unit does not fit it, no law can be fitted, or the strain
            may be in percent (USAGE).
        OSError: if the folder or the disk does not take the figure.
    """
    test = read_uniaxial_test(path, unit, **specimen)
    try:
        result = fit_test(test, settings)
    except NoFit as failure:
        raise Fault(ExitCode.USAGE, f"{path}: {failure}") from None
    except PercentOrNot as question:
        raise Fault(ExitCode.USAGE, f"{path}: {question}") from None
    figure = path.with_name(f"{path.stem}.fit.png") if plot else None
    if figure:
        # Load a drawing library.
        from pipeline.figures.fit import fit as fit_figure
        from pipeline.figures.saving import save

        save(fit_figure(result, path.name), figure)
    return FitReport(path, test, result, figure)


class PercentOrNot(Failure):
    """A strain without unit that may be in percent."""


def fit_test(test: UniaxialTest, settings: fit.Settings) -> fit.Result:
    """Fit laws to a test that was read, whose strain may be in percent without saying so.

    Raises:
        NoFit: if no law can be fitted.
        PercentOrNot: if E tells that the strain, as a ratio, is none, while percent would do.
    """
    if not test.bare_strain:
        return fit.run(test.stretch, test.stress, settings, test.lines)
    percent = 1.0 + (test.stretch - 1.0) / 100.0
    if np.median(test.stretch - 1.0) > PERCENT:
        result = fit.run(percent, test.stress, settings, test.lines)
        return _warned(result, f"The strain has no unit and goes to {test.stretch.max() - 1.0:.4g}: taken for percent.")
    result = fit.run(test.stretch, test.stress, settings, test.lines)
    if result.youngs_modulus >= SOFT:
        return result
    try:
        other = fit.run(percent, test.stress, settings, test.lines).youngs_modulus
    except NoFit:
        return result
    sentence = (
        f"The strain has no unit. As a ratio it makes E {result.youngs_modulus:.2g} N/mm², in percent {other:.3g} N/mm²"
        ". Write 'strain [%]' or 'strain [-]' into the header, or correct the unit of the stress"
    )
    if other <= fit.STIFFEST and (result.youngs_modulus < fit.SOFTEST or not result.strained):
        raise PercentOrNot(f"{sentence}.")
    return _warned(result, f"{sentence} if need be.") if test.stretch.max() > FAR else result


def _warned(result: fit.Result, sentence: str) -> fit.Result:
    return replace(result, warnings=[sentence, *result.warnings])


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:+.1f} %"


def case_section(found: fit.Fit) -> str:
    """The section ``material`` of a case file with a fitted law, ready to paste."""
    lines = ["material:", f"  youngs_modulus: {_number(found.youngs_modulus)}", "  law:", f"    name: {found.name}"]
    for key, value in found.ratios.items():
        if isinstance(value, list):
            lines.append(f"    {key}: [{', '.join(_number(each) for each in value)}]")
        else:
            lines.append(f"    {key}: {_number(value)}")
    return "\n".join(lines)


def _number(value: float) -> str:
    """Nine digits, so that an Ogden law still adds up."""
    return number_text(f"{value:.9g}")
