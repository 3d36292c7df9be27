"""Settings against their schema: that of the whole config, or of the section that a step is given by hand.

Apart from :mod:`gpca.config.check`, because every step imports this: what it imports counts as code of all of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from inspect import isclass, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin, get_type_hints

from gpca.errors import InputError

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError


class Bounds:
    """What the values of a settings class's field may be, in the words of JSON schema.

    A field says it with its type, ``train: Annotated[int, Bounds(minimum=9)]``; the config's schema is made from that.
    A number without a `maximum` has the one of its type, `LARGEST`.
    """

    def __init__(self, **keywords: object) -> None:
        self.keywords = keywords


# No count of a run comes near a million, and no setting near the other: what is above is a slip, which would otherwise
# end hours later, or in no memory left.
LARGEST = {"integer": 10**6, "number": 1e12}

Count = Annotated[int, Bounds(minimum=1)]
NotNegative = Annotated[float, Bounds(minimum=0)]
Positive = Annotated[float, Bounds(exclusiveMinimum=0)]
Share = Annotated[float, Bounds(minimum=0, maximum=1)]
PositiveShare = Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)]
OpenShare = Annotated[float, Bounds(exclusiveMinimum=0, exclusiveMaximum=1)]

SCHEMA = Path(__file__).parent / "config" / "config.schema.yaml"


@cache
def load_schema() -> dict:
    """Return the JSON schema of a configuration: one object for all who ask."""
    import yaml

    return yaml.load(SCHEMA.read_text(encoding="utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def check_settings(settings: dict, *section: str) -> None:
    """Check what a step was given with ``--settings`` like that section of the config; none of its keys is required.

    Args:
        section: the section's path, e.g. ``"encoders", "dgcnn"``.

    Raises:
        InputError: unknown key, wrong type or value out of range.
    """
    whole = part = load_schema()
    for key in section:
        part = part.get("properties", {}).get(key) or part["additionalProperties"]
    require_valid(settings, part | {"$defs": whole["$defs"]}, "setting", complete=False)


def checked_sections(
    settings: Mapping[str, dict], sections: Mapping[str, tuple[str, ...]], by_name: Collection[str] = ()
) -> dict[str, dict]:
    """Return the parts of ``--settings`` by name, each checked like a section of the config; what is absent is empty.

    Args:
        settings: name -> part.
        sections: name -> path of the section.
        by_name: further parts, which are for :func:`checked_by_name`.

    Raises:
        InputError: an unknown name, or what :func:`check_settings` refuses.
    """
    known = (*sections, *by_name)
    if unknown := set(settings) - set(known):
        raise InputError(f"setting {sorted(unknown)[0]}", "unknown", f"choose one of {', '.join(known)}")
    given = {name: settings.get(name) or {} for name in known}
    for name, section in sections.items():
        check_settings(given[name], *section)
    return given


def checked_by_name(
    given: dict[str, Any], section: str, names: Collection[str], require: Callable[[str, Mapping], None]
) -> dict[str, dict]:
    """Return the settings of each of the names, none for those that a section of the config does not give.

    Args:
        given: that section, name -> settings.
        require: raises an InputError unless a name is known and takes its settings.
    """
    given = given or dict.fromkeys(names)
    check_settings(given, section)
    for name in (*given, *names):
        require(name, given.get(name) or {})
    return {name: given.get(name) or {} for name in names}


def checked_with_icp(settings: Mapping[str, Any], *section: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return ``--settings`` that are a section of the config, and those of ICP, which they hold under ``icp``."""
    given = dict(settings)
    icp = given.pop("icp", {})
    check_settings(given, *section)
    check_settings(icp, "registrations", "icp")
    return given, icp


def require_arguments(subject: str, function: Callable, given: int, settings: Mapping[str, object]) -> None:
    """Check settings that go to a function by their names, where no schema has them.

    Args:
        subject: what has the settings, for the message.
        function: what takes them, after `given` other arguments.

    Raises:
        InputError: an unknown setting; one that its type does not allow (`Bounds`, or a literal); or one that is no
            number from 0 to `LARGEST` where the default is such a one.
    """
    try:
        bound = signature(function).bind(*[None] * given, **settings)
    except TypeError as fault:
        raise InputError(subject, str(fault), "correct its settings") from fault
    function = getattr(function, "func", function)  # of a partial
    hints = get_type_hints(function.__init__ if isclass(function) else function, include_extras=True)
    for name, value in settings.items():
        if get_origin(hints.get(name)) is Literal and value not in (choices := get_args(hints[name])):
            raise InputError(f"{subject}: setting {name}", f"must be one of {', '.join(choices)}, not {value!r}")
        default = getattr(bound.signature.parameters.get(name), "default", None)
        schema = {"properties": {name: _schema_of_argument(default, hints.get(name))}}
        require_valid({name: value}, schema, f"{subject}: setting")


def _schema_of_argument(default: Any, hint: Any) -> dict[str, Any]:
    """Return what a function's argument may be, by its default and its type."""
    kind = {int: "integer", float: "number"}.get(type(default))
    schema = {"type": kind, "minimum": 0, "maximum": LARGEST[kind]} if kind and default >= 0 else {}
    for bounds in getattr(hint, "__metadata__", ()):
        schema |= bounds.keywords
    return schema


def require_valid(instance: dict, schema: dict, subject: str, complete: bool = True) -> None:
    """Raise an InputError for the worst fault of `instance`; `subject` stands before the name of its key.

    Unless it has to be `complete`, missing keys are no fault.
    """
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match
    from jsonschema.validators import extend

    # JSON Schema takes 36.0 for an integer, and no limit stops NaN.
    types = Draft202012Validator.TYPE_CHECKER.redefine_many({"integer": _is_integer, "number": _is_finite_number})
    validator = extend(Draft202012Validator, {"pattern": _matches}, type_checker=types)(schema)
    faults = validator.iter_errors(instance)
    fault = best_match(fault for fault in faults if complete or fault.validator != "required")
    if fault is None:
        return
    key = ".".join(map(str, fault.absolute_path)) or "(top level)"
    if fault.validator == "additionalProperties":
        known = list(fault.schema["properties"])
        unknown = next(name for name in fault.instance if name not in known)
        path = ".".join([*map(str, fault.absolute_path), str(unknown)])
        close = get_close_matches(str(unknown), known, n=1)
        raise InputError(
            f"{subject} {path}",
            "unknown",
            f"did you mean {close[0]}?" if close else f"choose one of {', '.join(known)}",
        )
    if fault.validator == "type" and fault.schema["type"] == "array" and isinstance(fault.instance, str | int | float):
        raise InputError(f"{subject} {key}", fault.message, f"give a list: [{fault.instance}]")
    see = "add it, as in config/config.yaml" if fault.validator == "required" else "see gpca/config/config.schema.yaml"
    raise InputError(f"{subject} {key}", fault.message, see)


def _matches(_validator, pattern: str, value: object, _schema) -> Iterator[ValidationError]:
    """Find a pattern as JSON Schema means it: its ``$`` is the end, and not what is before a last line break."""
    from jsonschema.exceptions import ValidationError

    if isinstance(value, str) and not re.search(re.sub(r"\$$", r"\\Z", pattern), value):
        yield ValidationError(f"{value!r} does not match {pattern!r}")


def _is_integer(_checker, value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite_number(_checker, value: object) -> bool:
    return _is_integer(_checker, value) or (isinstance(value, float) and math.isfinite(value))
