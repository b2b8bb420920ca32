"""Files of recorded tests: the same numbers whatever units, delimiter and columns, and a sentence for each mistake."""

from __future__ import annotations

import codecs
import datetime
import tracemalloc
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import EXAMPLE, EXAMPLE_TRUTH, Truth, recording

from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.column_names import Quantity
from pipeline.measured.measurement import Measurement, read_measurement

ROWS = 30
TIME = 0.5 * np.arange(ROWS)
PRESSURE = 20.0 * np.sin(0.1 * np.arange(ROWS))
DISPLACEMENT = 1.1 * PRESSURE + 47.0

PRESSURE_UNITS = {"kPa": 1.0, "Pa": 1e-3, "MPa": 1e3, "bar": 100.0, "mbar": 0.1, "psi": 6.894757293168361, "hPa": 0.1}
DISPLACEMENT_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0}


def read(path: Path, sensitivities: dict[Quantity, float | None] | None = None, **columns: str) -> Measurement:
    wanted = {quantity: columns.get(quantity.value) for quantity in Quantity}
    return read_measurement(path, wanted, sensitivities)


def written(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


@settings(deadline=None)  # how long a file takes is the machine's matter
@given(
    pressure_unit=st.sampled_from(sorted(PRESSURE_UNITS)),
    displacement_unit=st.sampled_from(sorted(DISPLACEMENT_UNITS)),
    time_unit=st.sampled_from(sorted(TIME_UNITS)),
    order=st.permutations(range(4)),
    mark=st.sampled_from([",", ";", "\t"]),
    comma=st.booleans(),
    brackets=st.sampled_from(["[]", "()"]),
    names=st.sampled_from(
        [("pressure", "displacement", "time"), ("p", "u", "t"), ("Inlet pressure", "Travel", "TIME")]
    ),
    end=st.sampled_from(["\n", "\r\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    comments=st.integers(0, 3),
)
def test_same_numbers_whatever_the_file_looks_like(
    tmp_path_factory: pytest.TempPathFactory,
    pressure_unit: str,
    displacement_unit: str,
    time_unit: str,
    order: list[int],
    mark: str,
    comma: bool,
    brackets: str,
    names: tuple[str, str, str],
    end: str,
    encoding: str,
    comments: int,
) -> None:
    units = (pressure_unit, displacement_unit, time_unit)
    factors = (PRESSURE_UNITS[pressure_unit], DISPLACEMENT_UNITS[displacement_unit], TIME_UNITS[time_unit])
    titles = [f"{name} {brackets[0]}{unit}{brackets[1]}" for name, unit in zip(names, units, strict=True)]
    columns = [np.arange(ROWS), *(v / f for v, f in zip((PRESSURE, DISPLACEMENT, TIME), factors, strict=True))]
    titles = ["number", *titles]

    def cell(value: float) -> str:
        text = repr(float(value))
        return text.replace(".", ",") if comma and mark != "," else text

    lines = [f"# comment {number}" for number in range(comments)]
    lines.append(mark.join(titles[place] for place in order))
    lines += [mark.join(cell(columns[place][row]) for place in order) for row in range(ROWS)]
    path = tmp_path_factory.mktemp("read") / "test.csv"
    found = read(written(path, end.join([*lines, "", ""]), encoding))
    np.testing.assert_allclose(found.recording.pressure, PRESSURE, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.recording.displacement, DISPLACEMENT, rtol=1e-12)
    assert found.recording.time is not None
    np.testing.assert_allclose(found.recording.time, TIME, rtol=1e-12, atol=1e-12)
    assert found.comments == tuple(f"comment {number}" for number in range(comments))


def table(header: str, *columns: Iterable[object], mark: str = ",") -> str:
    rows = zip(*columns, strict=True)
    return "\n".join([header, *(mark.join(str(value) for value in row) for row in rows), ""])


@pytest.mark.parametrize("millivolts", [False, True])
def test_voltages_give_what_converted_values_give(tmp_path: Path, millivolts: bool) -> None:
    factor, unit = (1e3, "mV") if millivolts else (1.0, "V")
    volts = factor * PRESSURE / 19.17, factor * DISPLACEMENT / 12.5
    header = f"pressure_voltage [{unit}],displacement_voltage [{unit}]"
    found = read(written(tmp_path / "volts.csv", table(header, *volts)))
    np.testing.assert_allclose(found.recording.pressure, PRESSURE, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.recording.displacement, DISPLACEMENT, rtol=1e-12)
    assert found.recording.time is None
    other = read(tmp_path / "volts.csv", {Quantity.PRESSURE: 20.684, Quantity.DISPLACEMENT: 10.0}).recording
    np.testing.assert_allclose(other.pressure, PRESSURE * 20.684 / 19.17, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(other.displacement, DISPLACEMENT * 0.8, rtol=1e-12)


def test_columns_by_name_and_unit_in_the_option(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", table("ai0,ai1,old pressure [bar]", PRESSURE, DISPLACEMENT, PRESSURE))
    found = read(path, pressure="ai0 [kPa]", displacement="ai1 [mm]")
    np.testing.assert_array_equal(found.recording.pressure, PRESSURE)
    found = read(path, pressure="old pressure", displacement="ai1 [V]")
    np.testing.assert_allclose(found.recording.pressure, 100.0 * PRESSURE)
    np.testing.assert_allclose(found.recording.displacement, 12.5 * DISPLACEMENT)


def test_example_of_the_documents_is_marked_and_is_what_it_says() -> None:
    assert EXAMPLE.stat().st_size < 50_000
    assert "synthetic" in EXAMPLE.name
    found = read(EXAMPLE)
    assert found.comments[0].startswith("SYNTHETIC, not measured")
    made = recording(EXAMPLE_TRUTH)
    # Other versions of NumPy may draw other noise.
    np.testing.assert_allclose(found.recording.pressure, made.pressure, atol=0.3)
    np.testing.assert_allclose(found.recording.displacement, made.displacement, atol=0.2)


def test_long_recordings_take_little_memory(tmp_path: Path) -> None:
    truth = recording(Truth(rate=1000.0))
    assert truth.time is not None
    path = tmp_path / "long.csv"
    with path.open("w") as file:
        file.write("time [s],pressure [kPa],displacement [mm],unused\n")
        for row in zip(truth.time.tolist(), truth.pressure.tolist(), truth.displacement.tolist(), strict=True):
            file.write(f"{row[0]:.4f},{row[1]:.4f},{row[2]:.4f},0.123456789\n")
    tracemalloc.start()
    try:
        found = read(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(found.recording.pressure) == 96_000
    assert peak < 3 * 96_000 * 8 * 3


GOOD = "pressure [kPa],displacement [mm],time [s]"
#: Text, and what the sentence must say after the file's name.
WRONG = {
    "empty": ("", ": the file is empty; give the recorded test."),
    "only comments": ("# a\n# b\n", ": the file is empty"),
    "no rows": (f"{GOOD}\n", ": there are no rows below the header"),
    "no pressure": (
        "temperature [K],displacement [mm]\n1,2\n",
        ":1: no column is the pressure; write 'pressure [kPa]'",
    ),
    "no displacement": ("# x\npressure [kPa],x [mm]\n1,2\n", ":2: no column is the displacement"),
    "no header": ("0.1,0.2\n0.3,0.4\n", ":1: no column is the pressure"),
    "other text before the header": ("LabVIEW\npressure [kPa],u [mm]\n", "lines above the header must begin with #"),
    "two pressures": (
        "pressure [kPa],pressure_voltage [V],u [mm]\n1,2,3\n",
        ":1: the columns 'pressure [kPa]', 'pressure_voltage [V]' may all be the pressure; name one with "
        "--pressure-column.",
    ),
    "unknown unit": (
        "pressure [furlong],u [mm]\n1,2\n",
        ":1: column 'pressure [furlong]': 'furlong' is no unit of pressure that is known; write one",
    ),
    "prefix in another case": ("pressure [mPa],u [mm]\n1,2\n", "'mPa' is no unit of pressure that is known"),
    "no unit": ("pressure,u [mm]\n1,2\n", ":1: column 'pressure': it has no unit; write one of kPa"),
    "unit of time": (
        "pressure [kPa],u [mm],time [V]\n1,2,3\n",
        ":1: column 'time [V]': 'V' is no unit of time that is known",
    ),
    "text": (f"{GOOD}\n1,2,3\n1,n/a,3\n", ":3: column 'displacement [mm]': 'n/a' is no number; correct or remove"),
    "empty cell": (f"{GOOD}\n1,,3\n", ":2: column 'displacement [mm]': the cell is empty"),
    "nan": (f"{GOOD}\n# c\n\nnan,2,3\n", ":4: column 'pressure [kPa]': 'nan' is no finite number"),
    "infinite": (f"{GOOD}\n1,-inf,3\n", ":2: column 'displacement [mm]': '-inf' is no finite number"),
    "short row": (f"{GOOD}\n1,2,3\n1,2\n", ":3: the row has 2 cells and the header 3; complete or remove the line."),
    "decimal comma": (
        'pressure [kPa],displacement [mm]\n"1,5",2\n',
        ":2: column 'pressure [kPa]': '1,5' has a decimal comma; separate the cells by semicolons or tabs.",
    ),
    "thousands": ("p [kPa];u [mm]\n1.234,5;2\n", ":2: column 'p [kPa]': '1.234,5' is no number"),
    "time": (f"{GOOD}\n1,2,3\n1,2,2\n", ":3: column 'time [s]': the time 2 comes after 3; put the rows in the order"),
    "endless line": ("pressure " * 20_000, ":1: is too long for a table"),
    "quote over lines": (f'{GOOD}\n1,2,3\n"1,2,3\n1",2,3\n', ":4: column 'pressure [kPa]': a quotation mark before"),
    "open quote": (f'{GOOD}\n"1,2,3\n' + "1,2,3\n" * 30_000, ": this is no table"),
}


@pytest.mark.parametrize("name", WRONG)
def test_each_mistake_gives_a_sentence_with_its_place(name: str, tmp_path: Path) -> None:
    text, sentence = WRONG[name]
    path = written(tmp_path / "test.csv", text)
    with pytest.raises(Fault) as caught:
        read(path)
    assert caught.value.code == ExitCode.ARTIFACT
    assert str(caught.value).startswith(f"{path}:")
    assert sentence in str(caught.value)
    assert str(caught.value).endswith(".")


def test_what_is_no_text_or_not_there(tmp_path: Path) -> None:
    binary = tmp_path / "a.csv"
    binary.write_bytes(b"\x89HDF\0\0")
    for path, sentence in (
        (binary, "no text file"),
        (tmp_path / "missing.csv", "no such file"),
        (tmp_path, "this is a folder"),
    ):
        with pytest.raises(Fault, match=sentence) as caught:
            read(path)
        assert caught.value.code == ExitCode.ARTIFACT
    binary.write_bytes(codecs.BOM_UTF16_LE)
    with pytest.raises(Fault, match="the file is empty"):
        read(binary)


def test_options_that_do_not_fit_the_file(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", table("pressure [kPa],displacement [mm]", PRESSURE, DISPLACEMENT))
    with pytest.raises(
        Fault, match=r"--pressure-column: .*a.csv:1 has no column 'pres'; name 'pressure \[kPa\]'"
    ) as caught:
        read(path, pressure="pres")
    assert caught.value.code == ExitCode.USAGE
    with pytest.raises(Fault, match="--displacement-sensitivity goes with a voltage") as caught:
        read(path, {Quantity.DISPLACEMENT: 12.5})
    assert caught.value.code == ExitCode.USAGE
    with pytest.raises(Fault, match="cannot be pressure and displacement") as caught:
        read(written(path, table("ai0,ai1", PRESSURE, DISPLACEMENT)), pressure="ai0 [V]", displacement="ai0 [V]")
    assert caught.value.code == ExitCode.USAGE


# ------------------------------------------------------------------------------------------------ as instruments write

MADE = recording(Truth(loop=1.0, rate=2.0, cycles=2))
assert MADE.time is not None
NUMBERS = [MADE.time, MADE.pressure, MADE.displacement]


def stamps(form: str) -> list[str]:
    """Times of day that pass midnight."""
    begin = datetime.datetime(2025, 12, 31, 23, 59, 30)
    return [(begin + datetime.timedelta(seconds=float(each))).strftime(form) for each in NUMBERS[0]]


def text(header: str, *columns: Iterable[object], mark: str = ",", comma: bool = False) -> str:
    columns = tuple([f"{x:.9g}" if isinstance(x, float) else x for x in column] for column in columns)
    found = table(header, *columns, mark=mark)
    return found.replace(".", ",") if comma else found


TIME_S, KPA, MM = NUMBERS
LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nTime\t13:20:11.1\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\nSamples\t100\t100\t\nY_Unit_Label\tkPa\tmm\t\nX0\t0.0\t0.0\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tPressure\tDisplacement\tComment"
)
WRITTEN = {
    "names with units": text("time_s,pressure_kPa,displacement_mm", *NUMBERS),
    "units after commas": text("Time, s,Pressure, kPa,Displacement, mm", *NUMBERS),
    "units in a row": text(
        "Time;Pressure;Displacement\n[s];[mbar];[µm]", TIME_S, 10 * KPA, 1e3 * MM, mark=";", comma=True
    ),
    "sep=": text("sep=;\nTime [s];Pressure (psi);Travel [cm]", TIME_S, KPA / 6.894757293168361, MM / 10, mark=";"),
    "mmHg and inches": text("time [min],p [mmHg],u [in]", TIME_S / 60, KPA / 0.133322387415, MM / 25.4),
    "gauge pressure": text("t [s]|Pressure (psig)|travel (mm)", TIME_S, KPA / 6.894757293168361, MM, mark="|"),
    "LabVIEW": text(LVM, *NUMBERS, mark="\t"),
    "preamble": text(
        "Rig 2; pressure test\n\nOperator;me\nDate;2025-12-31\ntime [s];pressure [kPa];disp [mm]", *NUMBERS, mark=";"
    ),
    "setpoint beside": text("time [s],pressure setpoint [kPa],pressure [kPa],u [mm]", TIME_S, np.round(KPA), KPA, MM),
    "blanks": text("time[s] pressure[kPa] displacement[mm]", *NUMBERS, mark=" "),
    "ISO": text("timestamp,pressure [kPa],u [mm]", stamps("%Y-%m-%dT%H:%M:%S.%f"), KPA, MM),
    "German": text("Time;p [kPa];u [mm]", stamps("%d.%m.%Y %H:%M:%S,%f"), KPA, MM, mark=";").replace(".", ","),
    "half days": text("Time,p [kPa],u [mm]", stamps("%m/%d/%Y %I:%M:%S.%f %p"), KPA, MM),
    "spreadsheet days": text("Date,p [kPa],u [mm],Time", KPA, KPA, MM, [f"{46022.99 + t / 86400:.9f}" for t in TIME_S]),
    "milliseconds": text(
        "Booting...\nOK\nmillis,pressure_kPa,distance_mm", [f"{1e3 * t:.0f}" for t in TIME_S], KPA, MM
    ),
    "serial monitor": "14:23:05.100 -> p (kPa),u (mm)\n"
    + "".join(f"{t[:-3]} -> {p:.9g},{u:.9g}\n" for t, p, u in zip(stamps("%H:%M:%S.%f"), KPA, MM, strict=True)),
    "message and end": text(GOOD, KPA, MM, TIME_S) + "End of test\n",
    "UTF-16 by tabs": text("time [s]\tpressure [kPa]\tdisplacement [mm]", *NUMBERS, mark="\t"),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_same_numbers_as_instruments_write_them(name: str, tmp_path: Path) -> None:
    encoding = "utf-16" if name.startswith("UTF-16") else "utf-8"
    found = read(written(tmp_path / "test.csv", WRITTEN[name], encoding)).recording
    np.testing.assert_allclose(found.pressure, KPA, atol=1e-6)
    np.testing.assert_allclose(found.displacement, MM, atol=1e-6)
    assert found.time is not None
    np.testing.assert_allclose(found.time - found.time[0], TIME_S, atol=1e-3)


@pytest.mark.parametrize("mark", ["+9.91000000E+37", "NaN", "OVLD", "", "---", "#N/A", "inf"])
def test_marks_of_lost_numbers_are_left_out_and_named(mark: str, tmp_path: Path) -> None:
    cells = [mark if row % 10 == 3 else f"{value:.6f}" for row, value in enumerate(MM)]
    found = read(written(tmp_path / "test.csv", text(GOOD, KPA, cells, TIME_S)))
    (left,) = found.left_out
    assert (left.count, left.line, left.text) == (len(MM) // 10 + (len(MM) % 10 > 3), 5, mark)
    assert "displacement [mm]" in str(left)
    kept = np.arange(len(MM)) % 10 != 3
    np.testing.assert_allclose(found.recording.pressure, KPA[kept], atol=1e-6)
    np.testing.assert_array_equal(found.lines, np.flatnonzero(kept) + 2)


def test_rows_that_are_no_rows_are_named(tmp_path: Path) -> None:
    lines = text(GOOD, KPA, MM, TIME_S).splitlines()
    lines[20:20] = [lines[0], "sensor not ready", "0,0,0"]
    found = read(written(tmp_path / "test.csv", "\n".join([*lines, "12.5,1"])))
    assert [(each.why, each.count, each.line) for each in found.left_out] == [
        ("of text", 2, 21),
        ("cut short", 1, len(lines) + 1),
        ("out of the order of time", 1, 23),
    ]
    np.testing.assert_allclose(found.recording.pressure, KPA, atol=1e-6)


def test_angle_and_force_beside_travel(tmp_path: Path) -> None:
    columns = TIME_S, KPA, 0.02 * MM / 4.4482216152605, np.radians(MM), MM
    header = "time [s],pressure [kPa],tip load [lbf],bending angle [rad],load displacement [mm]"
    found = read(written(tmp_path / "a.csv", text(header, *columns)))
    assert list(found.recordings) == [Quantity.DISPLACEMENT, Quantity.ANGLE, Quantity.FORCE]
    for quantity, values in ((Quantity.DISPLACEMENT, MM), (Quantity.ANGLE, MM), (Quantity.FORCE, 0.02 * MM)):
        np.testing.assert_allclose(found.recordings[quantity].displacement, values, atol=1e-6)
    alone = read(written(tmp_path / "b.csv", text("t,p [kPa],θ [°]", TIME_S, KPA, MM)))
    assert alone.recording.answer == "angle"
    found = read(written(tmp_path / "c.csv", text("p [kPa],u [mm],force [V]", KPA, MM, MM)))
    assert list(found.recordings) == [Quantity.DISPLACEMENT]
    assert "the force is not compared: column 'force [V]'" in found.notes[0]


def test_sensitivity_that_nobody_gave_is_said(tmp_path: Path) -> None:
    path = written(tmp_path / "volts.csv", text("pressure [V],displacement [mm]", KPA / 19.17, MM))
    found = read(path)
    assert found.assumed == {Quantity.PRESSURE: 19.17}
    assert "give that of your sensor with --pressure-sensitivity" in found.notes[0]
    assert read(path, {Quantity.PRESSURE: 11.11}).assumed == {}
