"""The report of ``poro compare`` for people."""

from __future__ import annotations

from pipeline.measured.comparison import Comparison
from stages.compare.deviations import Linearity


def as_text(found: Comparison, format: str) -> str:
    """One line for each number that was asked for, and one for each thing that was done or left out."""
    result, case = found.result, found.job.case
    count = len(result.cycles)
    head = f"{case.name}: {found.measurement.path}, {len(found.measurement.recording.pressure)} rows, "
    lines = [f"{head}{count} {'cycle' if count == 1 else 'cycles'} compared"]
    lines += [_line("comment", found.measurement.comments[0])] if found.measurement.comments else []
    curve = f", to {found.prediction.pressure.max():.4g} kPa" if found.prediction.curve else ""
    lines += [
        _line("part", f"scale {case.export.scale:g}, Ē {case.rig.youngs_modulus:g} N/mm²"),
        _line("prediction", f"{found.source.words}, {found.source.path}{curve}"),
        *_beside(found),
        _line("columns", ", ".join(f"'{column.title}'" for column in found.measurement.columns.values())),
        *_aligned(found),
        _line(f"at {result.target.pressure:.4g} kPa", _target(found)),
    ]
    if result.overall:
        low, high = result.overall.pressures
        lines += [
            _line(f"{low:.3g} to {high:.4g} kPa", f"root mean square deviation {result.overall.rms:.2f} mm"),
            _line("", f"largest {result.overall.largest:+.2f} mm, at {result.overall.at:.3g} kPa"),
        ]
    lines += _hysteresis(found)
    lines.append(_line("linearity", f"measured   {_linear(result.linearity)}"))
    if result.predicted_linearity:
        lines.append(_line("", f"predicted  {_linear(result.predicted_linearity)}"))
    lines += _stiffness(found)
    lines += [_line("note", text) for text in (*found.source.notes, *result.notes)]
    files = found.files(format)
    lines += [_line("files" if file == files[0] else "", str(file)) for file in files]
    return "\n".join(lines)


def _aligned(found: Comparison) -> list[str]:
    alignment = found.result.alignment
    if not alignment.rows:
        zero = "as recorded"
    else:
        zero = f"{alignment.pressure:.4g} kPa and {alignment.displacement:.4g} mm, median of {alignment.rows} rows"
    lines = [_line("zero", zero)]
    if alignment.turned:
        lines.append(_line("sign", "the displacement falls as the pressure rises; its sign was turned"))
    if alignment.lag:
        lines.append(_line("lag", f"the displacement was moved {alignment.lag:g} s back"))
    return lines


def _target(found: Comparison) -> str:
    target = found.result.target
    spread = "" if target.spread is None else f" ± {target.spread:.2g}"
    if target.predicted is None or target.deviation is None:
        return f"measured {target.mean:.2f}{spread} mm; the prediction does not say"
    percent = "" if target.percent is None else f" ({target.percent:+.1f} %)"
    compared = f"predicted {target.predicted:.2f} mm: {target.deviation:+.2f} mm{percent}"
    return f"measured {target.mean:.2f}{spread} mm, {compared}"


def _beside(found: Comparison) -> list[str]:
    at = f"at {found.result.target.pressure:.4g} kPa"
    return [
        _line("", f"drawn beside: {source.words}, {'not known' if value is None else f'{value:.2f} mm'} {at}")
        for source, value in found.others_at_target
    ]


def _hysteresis(found: Comparison) -> list[str]:
    loop = found.result.hysteresis
    if loop is None:
        return [_line("hysteresis", "not known without a whole unloading")]
    lines = [
        _line("hysteresis", f"{loop.area:.1f} % of the area under loading"),
        _line("", f"largest width {loop.width:.1f} % of full scale, at {loop.at:.3g} kPa"),
    ]
    if loop.lag is not None:
        lines.append(_line("", f"a displacement sensor {loop.lag:.2g} s late would look the same"))
    return lines


def _linear(line: Linearity) -> str:
    return f"R² {line.r_squared:.4f}, largest deviation {line.largest:.1f} % of full scale, {line.slope:.3f} mm/kPa"


def _stiffness(found: Comparison) -> list[str]:
    hint, overall = found.result.stiffness, found.result.overall
    modulus = found.job.case.rig.youngs_modulus
    if hint is None or overall is None or modulus is None:
        return []
    if not hint.inside:
        return [_line("stiffness", "no Ē within a factor of 4 fits best; check units and sensitivities")]
    left = f"leaves {hint.rms:.2f} mm of {overall.rms:.2f} mm (root mean square)"
    return [_line("stiffness", f"Ē = {modulus * hint.factor:.3g} N/mm² ({hint.factor:.3f} times) fits best, {left}")]


def _line(name: str, value: str) -> str:
    return f"  {name:<20}{value}"
