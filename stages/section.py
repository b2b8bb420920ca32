"""What every section of a case file is made of."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, field_validator

#: Size of the numbers of a case file, in whatever unit.
SMALLEST, LARGEST = 1e-20, 1e20


class Section(BaseModel):
    """A frozen section of the case file; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _in_range(cls, value: Any) -> Any:
        """Refuse numbers of which a product of several would overflow or vanish."""
        if isinstance(value, float) and value and not SMALLEST <= abs(value) <= LARGEST:
            raise ValueError(f"must be 0 or between {SMALLEST:g} and {LARGEST:g} in size")
        return value

    def in_units(self, length: float, stress: float) -> Self:
        """The same section with lengths and stresses counted in other units.

        Args:
            length, stress: the units, mm and N/mm². A number's own unit stands in brackets in its description.
        """
        divisors = {"[mm]": length, "[N/mm²]": stress}
        changed: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            unit = next((unit for unit in divisors if unit in (field.description or "")), None)
            if isinstance(value, Section):
                changed[name] = value.in_units(length, stress)
            elif unit and value is not None:
                changed[name] = value / divisors[unit]
        return self.model_copy(update=changed)
