"""Settings: types of a settings class, or of a function's arguments, that pydantic checks and names the faults of."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from difflib import get_close_matches
from functools import cache, partial
from inspect import Parameter, isclass, signature
from math import isfinite
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from gpca.errors import InputError

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, TypeAdapter
    from pydantic_core import CoreSchema, ErrorDetails

T = TypeVar("T")
Scalar = bool | int | float | str | None
LARGEST = {"int": 10**6, "float": 1e12}  # larger numbers are typos, which would end hours later or in no memory
PYDANTIC = {  # JSON schema -> pydantic
    **{"minimum": "ge", "maximum": "le", "exclusiveMinimum": "gt", "exclusiveMaximum": "lt"},
    "multipleOf": "multiple_of",
}
UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")  # pydantic's faults


class Bounds:
    """The range of a number in words of JSON schemas (`PYDANTIC`), by default up to `LARGEST`."""

    def __init__(self, **bounds: float) -> None:
        self._bounds = {PYDANTIC[name]: bound for name, bound in bounds.items()}

    def __get_pydantic_core_schema__(self, kind: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Add the range to the number's schema."""
        schema: dict[str, Any] = dict(handler(kind))
        upper = {} if {"le", "lt"} & self._bounds.keys() else {"le": LARGEST[schema["type"]]}
        return schema | self._bounds | upper

    def hold(self, number: float) -> bool:
        """Return whether a number is in the range; a multiple is left to pydantic."""
        compare = {"ge": operator.ge, "le": operator.le, "gt": operator.gt, "lt": operator.lt}
        bounds = {"le": LARGEST[type(number).__name__]} | self._bounds
        return all(compare[name](number, bound) for name, bound in bounds.items())


Count = Annotated[int, Bounds(minimum=1)]
NotNegative = Annotated[float, Bounds(minimum=0)]
Positive = Annotated[float, Bounds(exclusiveMinimum=0)]
Share = Annotated[float, Bounds(minimum=0, maximum=1)]
PositiveShare = Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)]
OpenShare = Annotated[float, Bounds(exclusiveMinimum=0, exclusiveMaximum=1)]


@dataclass(frozen=True, eq=False)
class Different:
    """Marks a list of at least `fewest` different values."""

    fewest: int = 1

    def __get_pydantic_core_schema__(self, kind: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Add the check to the list's schema."""
        from pydantic_core import core_schema

        return core_schema.no_info_after_validator_function(self._checked, handler(kind))

    def _checked(self, values: Collection) -> Collection:
        if len(values) < self.fewest:
            raise ValueError(f"is empty; name at least {self.fewest}")
        if any(value in tuple(values)[:n] for n, value in enumerate(values)):
            raise ValueError(f"{list(values)} holds a value twice; keep one of them")
        return values


Distinct = Annotated[tuple[T, ...], Different()]  # one or more


@dataclass(frozen=True, eq=False)
class Keys:
    """Marks a mapping with a type for each key; some are required, and others are refused if it is closed."""

    kinds: Mapping[str, Any]
    required: Collection[str] = ()
    closed: bool = True

    def __get_pydantic_core_schema__(self, _kind: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the mapping's schema."""
        from pydantic_core import core_schema

        fields = {
            name: core_schema.typed_dict_field(handler.generate_schema(kind), required=name in self.required)
            for name, kind in self.kinds.items()
        }
        others: Literal["forbid", "allow"] = "forbid" if self.closed else "allow"
        strict = core_schema.CoreConfig(strict=True, allow_inf_nan=False)
        return core_schema.typed_dict_schema(fields, extra_behavior=others, config=strict)


def required(**kinds: Any) -> Keys:
    """Mark a mapping as one of these required keys with their types."""
    return Keys(kinds, required=kinds)


def part_of(settings: type, without: Collection[str] = ()) -> Keys:
    """Mark a mapping as the settings of a class without some names, all required."""
    return required(**changes_of(settings, without).kinds)


def changes_of(settings: type, without: Collection[str] = ()) -> Keys:
    """Mark a mapping as optional settings of a class without some names."""
    hints = get_type_hints(settings, include_extras=True)
    return Keys({name: kind for name, kind in hints.items() if name not in without})


def fields_of(section: Mapping[str, Any], *kinds: type) -> dict[str, Any]:
    """Return the entries of a section that are fields of one of these settings classes."""
    names = {field.name for kind in kinds for field in fields(kind)}
    return {name: value for name, value in section.items() if name in names}


def require_ascending(subject: str, settings: object, *names: str) -> None:
    for name in names:
        low, high = getattr(settings, name)
        if low > high:
            raise InputError(f"{subject}{name}", f"[{low}, {high}] is in descending order", "swap the two")


@dataclass(frozen=True)
class ArgumentsOf:
    """Marks a function's ``**arguments`` as those of another function or class."""

    function: Callable


def read_settings(kind: type[T], settings: Mapping[str, Any], subject: str = "setting") -> T:
    """Return an instance of a settings class from a section of a config."""
    with suppress(LookupError, TypeError, ValueError):
        return _fitted(kind, settings)
    from pydantic import ValidationError

    def as_json(value: Any) -> Any:  # what no config can hold becomes its text
        return dict(value) if isinstance(value, Mapping) else repr(value)

    adapter: TypeAdapter = _adapter(kind)  # type: ignore[arg-type]
    try:
        return adapter.validate_json(json.dumps([settings], default=as_json))[0]
    except ValidationError as fault:
        worst, *others = _input_errors(fault.errors(), settings, adapter, subject)
        worst.further = tuple(map(str, others))
        raise worst from None


def _fitted(kind: Any, value: Any) -> Any:
    """Return what pydantic makes of a value that plainly fits its type; LookupError for what it should look at."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated and all(isinstance(mark, Bounds) and mark.hold(value) for mark in parts[1:]):
        return _fitted(parts[0], value)
    if origin is Annotated and isinstance(keys := parts[1], Keys) and {*keys.required} <= {*value} <= {*keys.kinds}:
        return {name: _fitted(inner, value[name]) for name, inner in keys.kinds.items() if name in value}
    if origin is Literal and any(type(value) is type(part) and value == part for part in parts):
        return value
    if origin in (Union, UnionType):
        for part in parts:
            with suppress(LookupError, TypeError, ValueError):
                return _fitted(part, value)
    if origin is tuple and isinstance(value, list | tuple):
        kinds = [parts[0]] * len(value) if parts[-1] is ... else parts
        return tuple(_fitted(part, inner) for part, inner in zip(kinds, value, strict=True))
    if kind is dict and type(value) is dict:
        return {_fitted(str, name): _fitted(Scalar, inner) for name, inner in value.items()}
    if isclass(kind) and is_dataclass(kind) and isinstance(value, Mapping):
        hints = _hints(kind)
        return kind(**{name: _fitted(hints[name], inner) for name, inner in value.items()})
    if kind is float and type(value) is int:
        return float(value)
    if kind in get_args(Scalar) and type(value) is kind and (kind is not float or isfinite(value)):
        return value
    raise LookupError(kind)


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def require_arguments(subject: str, function: Callable, leading: int, settings: Mapping[str, object]) -> None:
    """Check settings that a function takes as named arguments, after `leading` others."""
    read_settings(_settings_of_arguments(function, leading), settings, f"{subject}: setting")


@cache
def _settings_of_arguments(function: Callable, leading: int) -> Any:
    return Annotated[dict, Keys(*_arguments(function, leading))]


def _arguments(function: Callable, leading: int) -> tuple[dict[str, Any], set[str], bool]:
    """Return the types of the arguments after the leading ones, those without a default, and whether these are all."""
    plain: Any = function.func if isinstance(function, partial) else function
    has_init = isclass(plain) and not is_dataclass(plain)
    hints = get_type_hints(plain.__init__ if has_init else plain, include_extras=True)
    kinds: dict[str, Any] = {}
    others: dict[str, Any] = {}
    required, closed = set(), True
    for parameter in list(signature(function).parameters.values())[leading:]:
        hint, default = hints.get(parameter.name, type(parameter.default)), parameter.default
        if parameter.kind is Parameter.VAR_KEYWORD:
            source = next((note for note in getattr(hint, "__metadata__", ()) if isinstance(note, ArgumentsOf)), None)
            closed = source is not None
            others = _arguments(source.function, 0)[0] if source else {}
        elif parameter.kind is not Parameter.VAR_POSITIONAL:
            is_free = hint not in (int, float) or default < 0
            kinds[parameter.name] = hint if is_free else Annotated[hint, Bounds(minimum=0)]
            if default is Parameter.empty:
                required.add(parameter.name)
    return others | kinds, required, closed


@cache
def _adapter(kind: Any) -> TypeAdapter:
    from pydantic import ConfigDict, TypeAdapter

    # Strict: neither 36.0 nor true is a whole number.
    config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)
    return TypeAdapter(list[kind], config=config)  # a list, as a dataclass takes no config from elsewhere


def _input_errors(faults: list[ErrorDetails], settings: Any, adapter: TypeAdapter, subject: str) -> list[InputError]:
    """Return the worst fault of each key: unknown keys first, then values of the right type."""
    worst: dict[tuple, InputError] = {}
    for fault in sorted(faults, key=lambda fault: (fault["type"] not in UNKNOWN, fault["type"].endswith("_type"))):
        path = list(_path(settings, fault["loc"][1:]))
        worst.setdefault(tuple(path), _input_error(fault, path, adapter, subject))
    return list(worst.values())


def _input_error(fault: ErrorDetails, path: list[str | int], adapter: TypeAdapter, subject: str) -> InputError:
    key, value = ".".join(map(str, path)), fault["input"]
    if fault["type"] in UNKNOWN:
        names = list(_keys_at(adapter.json_schema(), path[:-1]))
        close = get_close_matches(str(path[-1]), names, n=1)
        others = f"choose one of {', '.join(names)}" if names else "leave it out"
        return InputError(f"{subject} {key}", "unknown", f"did you mean {close[0]}?" if close else others)
    if fault["type"] == "missing" and isinstance(path[-1], int):
        return InputError(f"{subject} {'.'.join(map(str, path[:-1]))}", f"{value} is too short")
    if fault["type"] == "missing":
        return InputError(f"{subject} {key}", "is missing", "add it, as in config/config.yaml")
    if fault["type"] == "value_error":
        error = fault["ctx"]["error"]  # without a path, it concerns the settings as a whole and names them
        return InputError(f"{subject} {key}", str(error)) if path else error
    # Input should be less than ..., String should have ..., List should have at least 1 item after validation, not 0
    message = fault["msg"][fault["msg"].index("should") :].split(" after validation")[0]
    scalar = fault["type"] in ("tuple_type", "list_type") and isinstance(value, str | int | float)
    return InputError(f"{subject} {key}", f"{value!r} {message}", f"give a list: [{value}]" if scalar else "")


def _path(settings: Any, location: Iterable[str | int]) -> Iterator[str | int]:
    """Yield the keys of pydantic's location of a fault, without its names of the parts of unions."""
    for name in location:
        inside = dict(enumerate(settings)) if isinstance(settings, list) else settings
        if isinstance(inside, Mapping) and name in inside:
            settings = inside[name]
        elif name == "[key]" or not isinstance(settings, Mapping | list):
            continue
        yield name


def _keys_at(schema: dict, path: Iterable[str | int]) -> Iterator[str]:
    """Yield the keys that a JSON schema allows at a path."""

    def alternatives(part: dict) -> Iterator[dict]:
        part = schema["$defs"][part["$ref"].rpartition("/")[2]] if "$ref" in part else part
        yield part
        for inner in part.get("anyOf", ()):
            yield from alternatives(inner)

    parts = [schema["items"]]
    for name in path:
        inside = []
        for part in (each for whole in parts for each in alternatives(whole)):
            named = part.get("properties", {}).get(name)
            others = [*part.get("patternProperties", {}).values(), part.get("additionalProperties"), part.get("items")]
            inside += [named] if named else [other for other in others if isinstance(other, dict)]
        parts = inside
    for part in (each for whole in parts for each in alternatives(whole)):
        yield from part.get("properties", ())
