"""The report of ``poro compare`` for people."""

from __future__ import annotations

from pipeline.measured.column_names import Quantity
from pipeline.measured.comparison import Answer, Comparison
from stages.compare.deviations import Linearity


def as_text(found: Comparison, format: str) -> str:
    """One line for each number that was asked for, and one for each thing that was done or left out."""
    case, main = found.job.case, found.main
    count = len(main.result.cycles)
    rows = sum(len(measured.lines) for measured in found.measurements)
    paths = ", ".join(str(measured.path) for measured in found.measurements)
    lines = [f"{case.name}: {paths}, {rows} rows, {count} {'cycle' if count == 1 else 'cycles'} compared"]
    lines += [_line("comment", found.measurements[0].comments[0])] if found.measurements[0].comments else []
    curve = f", to {main.prediction.pressure.max():.4g} kPa" if main.prediction.curve else ""
    lines += [
        _line("part", f"scale {case.export.scale:g}, Ē {case.rig.youngs_modulus:g} N/mm²"),
        _line("prediction", f"{main.source.words}, {main.source.path}{curve}"),
        *_beside(main),
    ]
    for number, measured in enumerate(found.measurements):
        if len(found.measurements) > 1:
            lines.append(_line("file", str(measured.path)))
        lines.append(_line("columns", ", ".join(f"'{column.title}'" for column in measured.columns.values())))
        lines += [_line("left out", str(each)) for each in found.left_out(number)]
        lines += _aligned(main, number)
    for answer in found.answers:
        lines += _answer(answer, found)
    lines += [_line("note", text) for text in found.all_notes]
    files = found.files(format)
    lines += [_line("files" if file == files[0] else "", str(file)) for file in files]
    return "\n".join(lines)


def _answer(answer: Answer, found: Comparison) -> list[str]:
    """The numbers of what was compared."""
    result = answer.result
    lines = [] if answer is found.main else [_line(answer.quantity.value, answer.source.words)]
    lines.append(_line(f"at {result.target.pressure:.4g} kPa", _target(answer)))
    if len(result.recordings) > 1:
        each = ", ".join(f"{value:.2f}" for value in result.at_target)
        spread = f"{each} {answer.unit}, ± {result.at_target.std(ddof=1):.2g} {answer.unit} between the files"
        lines.append(_line("", spread))
    if result.overall:
        low, high = result.overall.pressures
        lines += [
            _line(f"{low:.3g} to {high:.4g} kPa", f"root mean square deviation {result.overall.rms:.2f} {answer.unit}"),
            _line("", f"largest {result.overall.largest:+.2f} {answer.unit}, at {result.overall.at:.3g} kPa"),
        ]
    lines += _hysteresis(answer)
    lines.append(_line("linearity", f"measured   {_linear(result.linearity, answer.unit)}"))
    if result.predicted_linearity:
        lines.append(_line("", f"predicted  {_linear(result.predicted_linearity, answer.unit)}"))
    return lines + _stiffness(answer, found)


def _aligned(answer: Answer, number: int) -> list[str]:
    alignment = answer.result.recordings[number].alignment
    name = answer.quantity.value
    if not alignment.rows:
        zero = "as recorded"
    else:
        offset = f"{alignment.pressure:.4g} kPa and {alignment.displacement:.4g} {answer.unit}"
        zero = f"{offset}, median of {alignment.rows} rows"
    lines = [_line("zero", zero)]
    if alignment.pressure_turned:
        lines.append(_line("sign", "the pressure falls from where most rows are, at rest; its sign was turned"))
    if alignment.turned:
        lines.append(_line("sign", f"the {name} falls as the pressure rises; its sign was turned"))
    if alignment.lag:
        lines.append(_line("lag", f"the {name} was moved {alignment.lag:g} s back"))
    return lines


def _target(answer: Answer) -> str:
    target, unit = answer.result.target, answer.unit
    spread = "" if target.spread is None else f" ± {target.spread:.2g}"
    if target.predicted is None or target.deviation is None:
        return f"measured {target.mean:.2f}{spread} {unit}; the prediction does not say"
    percent = "" if target.percent is None else f" ({target.percent:+.1f} %)"
    compared = f"predicted {target.predicted:.2f} {unit}: {target.deviation:+.2f} {unit}{percent}"
    return f"measured {target.mean:.2f}{spread} {unit}, {compared}"


def _beside(answer: Answer) -> list[str]:
    at = f"at {answer.result.target.pressure:.4g} kPa"
    return [
        _line(
            "", f"drawn beside: {source.words}, {'not known' if value is None else f'{value:.2f} {answer.unit}'} {at}"
        )
        for source, value in answer.others_at_target
    ]


def _hysteresis(answer: Answer) -> list[str]:
    loop = answer.result.hysteresis
    if loop is None:
        return [_line("hysteresis", "not known without a whole unloading")]
    lines = [
        _line("hysteresis", f"{loop.area:.1f} % of the area under loading"),
        _line("", f"largest width {loop.width:.1f} % of full scale, at {loop.at:.3g} kPa"),
    ]
    if loop.lag is not None:
        sensor = f"{'an' if answer.quantity is Quantity.ANGLE else 'a'} {answer.quantity} sensor"
        lines.append(_line("", f"{sensor} {loop.lag:.2g} s late would look the same"))
    return lines


def _linear(line: Linearity, unit: str) -> str:
    off = f"largest deviation {line.largest:.1f} % of full scale"
    return f"R² {line.r_squared:.4f}, {off}, {line.slope:.3f} {unit}/kPa"


def _stiffness(answer: Answer, found: Comparison) -> list[str]:
    hint, overall = answer.result.stiffness, answer.result.overall
    modulus = found.job.case.rig.youngs_modulus
    if hint is None or overall is None or modulus is None:
        return []
    if not hint.inside:
        return [_line("stiffness", "no Ē within a factor of 4 fits best; check units and sensitivities")]
    left = f"leaves {hint.rms:.2f} {answer.unit} of {overall.rms:.2f} {answer.unit} (root mean square)"
    return [_line("stiffness", f"Ē = {modulus * hint.factor:.3g} N/mm² ({hint.factor:.3f} times) fits best, {left}")]


def _line(name: str, value: str) -> str:
    return f"  {name:<20}{value}"
