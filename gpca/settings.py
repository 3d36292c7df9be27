"""Settings against their schema: that of the whole config, or of the section that a step is given by hand.

Apart from :mod:`gpca.config.check`, because every step imports this: what it imports counts as code of all of them.
"""

from __future__ import annotations

import math
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Annotated

import yaml

from gpca.errors import InputError


class Bounds:
    """What the values of a settings class's field may be, in the words of JSON schema.

    A field says it with its type, ``train: Annotated[int, Bounds(minimum=9)]``; the config's schema is made from that.
    """

    def __init__(self, **keywords: object) -> None:
        self.keywords = keywords


Count = Annotated[int, Bounds(minimum=1)]
NotNegative = Annotated[float, Bounds(minimum=0)]
Positive = Annotated[float, Bounds(exclusiveMinimum=0)]
Share = Annotated[float, Bounds(minimum=0, maximum=1)]
PositiveShare = Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)]
OpenShare = Annotated[float, Bounds(exclusiveMinimum=0, exclusiveMaximum=1)]

SCHEMA = Path(__file__).parent / "config" / "config.schema.yaml"


@cache
def load_schema() -> dict:
    """Return the JSON schema of a configuration: one object for all who ask, parsing it takes a tenth of a second."""
    return yaml.safe_load(SCHEMA.read_text(encoding="utf-8"))


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


def require_valid(instance: dict, schema: dict, subject: str, complete: bool = True) -> None:
    """Raise an InputError for the worst fault of `instance`; `subject` stands before the name of its key.

    Unless it has to be `complete`, missing keys are no fault.
    """
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match
    from jsonschema.validators import extend

    # JSON Schema takes 36.0 for an integer, and no limit stops NaN.
    types = Draft202012Validator.TYPE_CHECKER.redefine_many({"integer": _is_integer, "number": _is_finite_number})
    validator = extend(Draft202012Validator, type_checker=types)(schema)
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
            f"{subject} {path}", "unknown", f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}"
        )
    if fault.validator == "type" and fault.schema["type"] == "array" and isinstance(fault.instance, str | int | float):
        raise InputError(f"{subject} {key}", fault.message, f"give a list: [{fault.instance}]")
    raise InputError(f"{subject} {key}", fault.message, "see gpca/config/config.schema.yaml")


def _is_integer(_checker, value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite_number(_checker, value: object) -> bool:
    return _is_integer(_checker, value) or (isinstance(value, float) and math.isfinite(value))
