"""What every section of a case file is made of, and sections that come in several kinds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, field_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, SchemaValidator, core_schema

#: Size of the numbers of a case file, in whatever unit.
SMALLEST, LARGEST = 1e-20, 1e20


class Section(BaseModel):
    """A frozen section of the case file; unknown keys are refused.

    Attributes:
        gone: keys that earlier versions had, with what to do about them. Cases stored in artifacts may have them.
    """

    gone: ClassVar[Mapping[str, str]] = {}

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


@dataclass(frozen=True)
class Kinds:
    """Marks the type of a section that comes in several kinds, told apart by one of their keys.

    Paths in errors have the name of the kind after the section's, as with pydantic's own discriminated unions.

    Attributes:
        known: the kinds by name, a registry for instance; asked whenever a section is read, not when this is made.
        key: the key that tells them apart; every kind has it, a literal with its name.
        default: the kind that is meant where the key is left out; None if it must be there.
    """

    known: Mapping[str, type[Section]]
    key: str = "name"
    default: str | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """Read a section of any kind that is known by then."""
        lax, strict = (
            core_schema.no_info_plain_validator_function(partial(self._read, strict=strict)) for strict in (False, True)
        )
        return core_schema.lax_or_strict_schema(lax, strict)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The kinds that are known by now."""
        union = handler(self._union())
        kinds = dict(zip(self.known, union["oneOf"], strict=True))
        if len(kinds) == 1 and self.default:
            return dict(kinds[self.default])
        # Where the key is left out only the default fits.
        named = [kind if name == self.default else kind | {"required": [self.key]} for name, kind in kinds.items()]
        return union | {"oneOf": named}

    def _union(self) -> CoreSchema:
        choices = {name: kind.__pydantic_core_schema__ for name, kind in self.known.items()}
        return core_schema.tagged_union_schema(choices, discriminator=self.key)

    def _read(self, value: Any, strict: bool) -> Any:
        if isinstance(value, tuple(self.known.values())):
            return value
        if self.default and isinstance(value, Mapping):
            value = {self.key: self.default, **value}
        return SchemaValidator(self._union()).validate_python(value, strict=strict)
