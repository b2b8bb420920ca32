"""Quantities with units, counted in the unit of a key."""

from __future__ import annotations

import pytest

from stages.units import PRESSURES, quantity

#: Text, unit of the key, number; the exact definitions of the inch, the pound-force and the standard atmosphere.
QUANTITIES = [
    ("20 kPa", "kPa", 20.0),
    ("3psi", "kPa", 3.0 * PRESSURES["psi"]),
    (" 0.2  bar ", "kPa", 20.0),
    ("20 kpa", "kPa", 20.0),
    ("1 atm", "kPa", 101.325),
    ("10 kN/m²", "kPa", 10.0),
    ("70 kPa", "N/mm²", 0.07),
    ("0.07 MPa", "N/mm²", 0.07),
    ("0.07 N/mm2", "N/mm²", 0.07),
    ("0.07 N/mm^2", "N/mm²", 0.07),
    ("1.5 cm", "mm", 15.0),
    ("0.5 in", "mm", 12.7),
    ("1.5e1 mm", "mm", 15.0),
    ("100 µm", "mm", 0.1),
    ("50 N/m", "N/mm", 0.05),
    ("1 lbf/in", "N/mm", 0.45359237 * 9.80665 / 25.4),
]


@pytest.mark.parametrize(("text", "unit", "number"), QUANTITIES)
def test_a_quantity_is_counted_in_the_unit_of_its_key(text: str, unit: str, number: float) -> None:
    assert quantity(text, unit) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize("unit", PRESSURES)
def test_units_of_a_pressure_are_those_of_recorded_tests(unit: str) -> None:
    assert quantity(f"2e1 {unit}", "kPa") == pytest.approx(20.0 * PRESSURES[unit])


def test_a_round_quantity_is_the_number_that_a_user_would_write() -> None:
    assert (quantity("1.5 cm", "mm"), quantity("70 kPa", "N/mm²"), quantity("100 µm", "mm")) == (15.0, 0.07, 0.1)


@pytest.mark.parametrize(
    ("text", "unit", "part"),
    [
        ("10 mm", "kPa", "must be a pressure, and '10 mm' is a length; write it as in '20 kPa'"),
        ("10 kPa", "mm", "must be a length, and '10 kPa' is a pressure; write it as in '15 mm'"),
        ("10 degC", "mm", "must be a length, and '10 degC' is something else"),
        ("20 mPa", "kPa", "write MPa if that was meant"),
        ("20 kPa absolute", "kPa", "'kPa absolute' is no unit"),
        ("2 kPa**9**9**9", "kPa", "is no unit"),
        ("1e400 mm", "mm", "of finite size"),
        ("1,5 bar", "kPa", "not '1,5 bar'"),
        ("kPa", "kPa", "not 'kPa'"),
        ("", "kPa", "not ''"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_what_is_expected(text: str, unit: str, part: str) -> None:
    with pytest.raises(ValueError, match="write") as refused:
        quantity(text, unit)
    assert part in str(refused.value)
