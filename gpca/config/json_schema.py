"""JSON schema of a settings class, made from its fields: their types, and the bounds at them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from gpca.settings import LARGEST, Bounds

TYPES = {int: "integer", float: "number", bool: "boolean", str: "string", dict: "object"}


@dataclass(frozen=True)
class Keys:
    """Which fields of a settings class a section of the config has, where it has not all or where some are required.

    Attributes:
        required: names of fields; ``None``: those without a default, as of any class; `EVERY`: all of them.
        without: fields that the section does not have.
    """

    required: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Named:
    """Of a mapping: what the entries of these names are. With `closed` it has these, each of them, and no other."""

    kinds: Mapping[str, Any]
    closed: bool = False

    def keywords(self) -> dict[str, Any]:
        """Return the mapping's part of the schema."""
        properties = {name: schema_of(kind) for name, kind in self.kinds.items()}
        if self.closed:
            return {"additionalProperties": False, "required": list(properties), "properties": properties}
        return {"properties": properties}


EVERY = ("*",)  # all fields are required, those of its own fields' classes too
COMPLETE = Keys(required=EVERY)


def schema_of(kind: Any, keys: Keys | None = None) -> dict[str, Any]:
    """Return the JSON schema of a type.

    Args:
        kind: a dataclass; a number, text or boolean; a literal; a union; ``tuple[X, X]``, which is a list of two;
            ``tuple[X, ...]``, a list of different values, at least one; ``list[X]``, of any values, at least one;
            ``dict[str, X]``; any of them annotated.
        keys: of a dataclass, which of its fields there are.

    Raises:
        TypeError: a type that the config has no use for.
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _annotated(kind.__origin__, kind.__metadata__, keys)
    if is_dataclass(kind) and isinstance(kind, type):
        return _of_class(kind, keys or Keys())
    if origin is Literal:
        return {"enum": list(parts)}
    if origin in (Union, UnionType):
        return _union([schema_of(part, keys) for part in parts if part is not NoneType], NoneType in parts)
    if origin is tuple:
        items = {"items": schema_of(parts[0], keys)}
        if parts[1] is Ellipsis:
            return {"type": "array", "minItems": 1, "uniqueItems": True, **items}
        return {"type": "array", "minItems": len(parts), "maxItems": len(parts), **items}
    if origin is list:
        return {"type": "array", "minItems": 1, "items": schema_of(parts[0], keys)}
    if origin is dict:
        return {"type": "object", "additionalProperties": schema_of(parts[1], keys)}
    if kind in TYPES:
        largest = LARGEST.get(TYPES[kind])
        return {"type": TYPES[kind]} | ({"maximum": largest} if largest else {})
    raise TypeError(f"no JSON schema of {kind}")


def _annotated(kind: Any, notes: tuple, keys: Keys | None) -> dict[str, Any]:
    own = next((note for note in notes if isinstance(note, Keys)), keys)
    schema = schema_of(kind, own)
    for note in notes:
        if isinstance(note, Bounds):
            if "exclusiveMaximum" in note.keywords:
                schema.pop("maximum", None)
            schema = {**schema, **note.keywords}
        if isinstance(note, Named):
            schema = {**schema, **note.keywords()}
    return schema


def _of_class(kind: type, keys: Keys) -> dict[str, Any]:
    hints = get_type_hints(kind, include_extras=True)
    inner = COMPLETE if keys.required == EVERY else None
    own = [field for field in fields(kind) if field.name not in keys.without]
    required = list(keys.required or [f.name for f in own if f.default is MISSING and f.default_factory is MISSING])
    if keys.required == EVERY:
        required = [field.name for field in own]
    return {
        "type": "object",
        "additionalProperties": False,
        **({"required": required} if required else {}),
        "properties": {field.name: schema_of(hints[field.name], inner) for field in own},
    }


def _union(schemas: list[dict[str, Any]], or_null: bool) -> dict[str, Any]:
    if len(schemas) == 1 and or_null and isinstance(schemas[0].get("type"), str):
        return {**schemas[0], "type": [schemas[0]["type"], "null"]}
    return {"anyOf": [*([{"type": "null"}] if or_null else []), *schemas]}
