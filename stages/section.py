"""What every section of a case file is made of, and sections that come in several kinds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationInfo, field_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, SchemaValidator, core_schema

from stages.units import PATTERN, counted, is_quantity, unit_of

#: Size of the numbers of a case file, in whatever unit.
SMALLEST, LARGEST = 1e-20, 1e20


@dataclass(frozen=True)
class Instead:
    """A key that a case may have in place of another: the quantity that people know, for the ratio that is kept.

    Attributes:
        ratio: the key that it stands for.
        description: its meaning and unit, as that of a field.
    """

    ratio: str
    description: str


class Section(BaseModel):
    """A frozen section of the case file; unknown keys are refused.

    A number whose description has one of the units of :data:`stages.units.KINDS` in brackets may be text with a unit of
    its own, ``1.5 cm``.

    Attributes:
        gone: keys that earlier versions had, with what to do about them. Cases stored in artifacts may have them.
        instead: keys that a case may have in place of others. They are no fields: what is kept is the ratio.
    """

    gone: ClassVar[Mapping[str, str]] = {}
    instead: ClassVar[Mapping[str, Instead]] = {}

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _in_its_unit(cls, value: Any, info: ValidationInfo) -> Any:
        """Count a quantity in the unit of its key; of one in place of a ratio, say which key takes it."""
        name = str(info.field_name)
        if unit := unit_of(cls.model_fields[name].description):
            return [counted(each, unit) for each in value] if isinstance(value, list) else counted(value, unit)
        for key, instead in cls.instead.items():
            if instead.ratio == name and is_quantity(value):
                raise ValueError(f"is a number without a unit; write '{key}: {value.strip()}' in place of it")
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Numbers with units may be text, and ratios the quantities that they are made of."""
        found = handler(schema)
        section = handler.resolve_ref_schema(found)
        keys = section.get("properties", {})
        for name, field in cls.model_fields.items():
            if unit_of(field.description):
                keys[name] = _or_quantity(keys[name])
        for name, other in cls.instead.items():
            keys[name] = _or_quantity(
                {"description": other.description, "title": name.replace("_", " ").title(), "type": "number"}
            )
            section.setdefault("allOf", []).append({"not": {"required": [name, other.ratio]}})
        return found

    @field_validator("*")
    @classmethod
    def _in_range(cls, value: Any) -> Any:
        """Refuse numbers of which a product of several would overflow or vanish."""
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, float) and each and not SMALLEST <= abs(each) <= LARGEST:
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
            divisor = next((by for unit, by in divisors.items() if unit in (field.description or "")), None)
            changed[name] = _in_units(getattr(self, name), length, stress, divisor)
        return self.model_copy(update=changed)


def _in_units(value: Any, length: float, stress: float, divisor: float | None) -> Any:
    """The value of a key, or a list of them, in other units; one without a unit of its own has no divisor."""
    if isinstance(value, list):
        return [_in_units(each, length, stress, divisor) for each in value]
    if isinstance(value, Section):
        return value.in_units(length, stress)
    return value if divisor is None or value is None else value / divisor


def _or_quantity(key: JsonSchemaValue) -> JsonSchemaValue:
    """The schema of a number, or of a list of numbers, that may also be text with a unit."""
    if key.get("type") == "array":
        return key | {"items": _or_quantity(key["items"])}
    told = {name: key[name] for name in ("title", "description", "default") if name in key}
    number = {name: value for name, value in key.items() if name not in told}
    choices = number["anyOf"] if set(number) == {"anyOf"} else [number]
    if any(choice.get("type") == "array" for choice in choices):
        return told | {"anyOf": [_or_quantity(each) if each.get("type") == "array" else each for each in choices]}
    return {"anyOf": [*choices, {"type": "string", "format": "quantity", "pattern": PATTERN}]} | told


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
