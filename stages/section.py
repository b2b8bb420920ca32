"""What every section of a case file is made of."""

from __future__ import annotations

from typing import Any

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
