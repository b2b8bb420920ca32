"""What every section of a case file is made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, field_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, SchemaValidator, core_schema

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


class OneOf:
    """Annotates a section that comes in several kinds: one of its keys names the kind, whichever are registered.

    The section is read strictly, as a case file is. Paths in errors have the name of the kind after the section's, as
    with pydantic's own discriminated unions.

    Args:
        kinds: the registered sections by name; looked at anew whenever a section is read.
        key: the key whose value is the name; each kind has it as a literal.
        default: the kind that is meant where the key is left out; None if it must be there.
    """

    def __init__(self, kinds: Mapping[str, type[Section]], key: str, *, default: str | None = None) -> None:
        self.kinds, self.key, self.default = kinds, key, default

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        found = handler(self._union())["oneOf"]
        if len(found) == 1 and self.default:
            return dict(found[0])
        named = zip(self.kinds, found, strict=True)
        # A kind whose name may be left out fits, to a validator, whatever lacks it.
        return {"oneOf": [each if name == self.default else each | {"required": [self.key]} for name, each in named]}

    def _union(self) -> CoreSchema:
        choices = {name: kind.__pydantic_core_schema__ for name, kind in self.kinds.items()}
        return core_schema.tagged_union_schema(choices, discriminator=self.key)

    def _read(self, value: Any) -> Any:
        if isinstance(value, tuple(self.kinds.values())):
            return value
        if self.default and isinstance(value, Mapping):
            value = {self.key: self.default, **value}
        return SchemaValidator(self._union()).validate_python(value, strict=True)
