"""``poro fit``: read a uniaxial test, fit the laws of :mod:`stages.fit`, and tell how well they do."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pipeline.case.messages import number_text
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.measured.uniaxial_test import read_uniaxial_test
from pipeline.results.json_output import result_json
from stages import fit


@dataclass(frozen=True)
class FitReport:
    """Laws fitted to a file.

    Attributes:
        source: the CSV file.
        unit: of its stress.
        result: of the fits.
        plot: the figure, if one was drawn.
    """

    source: Path
    unit: str
    result: fit.Result
    plot: Path | None

    def as_text(self) -> str:
        """A table of the laws, what is doubtful about them, and the best one's section for a case file."""
        result = self.result
        low, high = result.stretch.min(), result.stretch.max()
        lines = [
            f"{self.source}: {len(result.stretch)} points, stretch {low:g} to {high:g}, stress in {self.unit}",
            f"  {'law':<14}{'E [N/mm²]':>10}{'R²':>10}{'rms':>10}{'largest error [N/mm²]':>26}{'AICc':>9}",
        ]
        for found in result.fits:
            largest = f"{found.largest_error:.4g} at {found.largest_at:.3f}"
            aicc = "-" if found.aicc is None else f"{found.aicc:.1f}"
            lines.append(
                f"  {found.name:<14}{found.youngs_modulus:>10.4g}{found.r_squared:>10.5f}"
                f"{found.root_mean_square:>10.3g}{largest:>26}{aicc:>9}"
            )
            values = ", ".join(f"{key} {value:.5g} {unit}".rstrip() for key, (value, unit) in found.literature.items())
            lines.append(f"    {values}")
            lines += [f"    warning: {sentence}" for sentence in found.warnings]
        lines += [f"  {name}: not fitted. {sentence}" for name, sentence in result.left_out.items()]
        if self.plot:
            lines.append(f"  {self.plot}")
        return "\n".join([*lines, f"For a case file ({result.best.name}):", "", case_section(result.best)])

    def as_json(self) -> str:
        """Everything, for other programs; stresses in N/mm²."""
        result = self.result
        found: dict[str, Any] = {
            "source": str(self.source),
            "points": len(result.stretch),
            "stretch": [float(result.stretch.min()), float(result.stretch.max())],
            "unit": self.unit,
            "best": result.best.name,
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
        }
        return result_json("fit", found, [self.plot] if self.plot else [])


def fit_file(path: Path, options: dict[str, Any], unit: str | None, *, plot: bool) -> FitReport:
    """Read a test, fit laws to it, and draw them beside it.

    Args:
        path: CSV; see :func:`pipeline.measured.uniaxial_test.read_uniaxial_test`.
        options: values of :class:`stages.fit.Settings` by name.
        unit: of the stress if the header has none.
        plot: whether to draw ``STEM.fit.png``.

    Raises:
        Fault: if the file cannot be used (ARTIFACT), or an option cannot or no law can be fitted (USAGE).
        OSError: if the folder or the disk does not take the figure.
    """
    settings = option_settings(fit.Settings, options)
    test = read_uniaxial_test(path, unit)
    try:
        result = fit.run(test.stretch, test.stress, settings)
    except fit.NoFit as failure:
        raise Fault(ExitCode.USAGE, f"{path}: {failure}") from None
    figure = path.with_name(f"{path.stem}.fit.png") if plot else None
    if figure:
        # Load a drawing library.
        from pipeline.figures.fit import fit as fit_figure
        from pipeline.figures.saving import save

        save(fit_figure(result, path.name), figure)
    return FitReport(path, test.unit, result, figure)


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
