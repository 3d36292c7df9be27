from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

import pytest

from gpca.errors import InputError
from gpca.settings import (
    ArgumentsOf,
    Bounds,
    Count,
    Different,
    Distinct,
    Keys,
    Share,
    changes_of,
    fields_of,
    part_of,
    read_settings,
    require_arguments,
)


@dataclass(frozen=True)
class Inner:
    size: Count = 2
    ends: tuple[float, float] = (0, 1)

    def __post_init__(self):
        if self.ends[0] > self.ends[1]:
            raise InputError("ends", "are in descending order", "swap the two")


@dataclass(frozen=True)
class Outer:
    name: str
    inner: Inner
    share: Share | None = None
    kinds: Distinct[Literal["a", "b"]] = ("a",)
    others: Annotated[tuple[int, ...], Different(fewest=0)] = ()
    by_name: Annotated[dict, Keys({"left": Inner, "right": Share}, required=("left",))] | None = None
    changes: Annotated[dict, changes_of(Inner, without=("ends",))] | None = None
    place: str | list[str] = ""


SOUND = {"name": "x", "inner": {}}


def test_a_class_is_made_with_all_that_it_holds_and_a_number_has_the_bounds_of_its_type():
    settings = {"name": "x", "inner": {"ends": [2, 3]}, "kinds": ["b", "a"], "by_name": {"left": {"size": 1}}}
    made = read_settings(Outer, settings)
    assert made == Outer("x", Inner(ends=(2, 3)), kinds=("b", "a"), by_name={"left": Inner(size=1)})
    assert read_settings(Annotated[float, Bounds(minimum=0)], 1e12) == 1e12
    with pytest.raises(InputError, match="less than or equal to"):
        read_settings(Annotated[float, Bounds(minimum=0)], 1e13)


@dataclass(frozen=True)
class Plain:
    sizes: tuple[Share, ...] = ()
    pairs: tuple[tuple[int, str], ...] = ()
    count: Count | None = None
    inner: Inner | None = None
    options: dict | None = None
    name: Literal["a", "b"] | bool | None = None
    by_name: Annotated[dict, Keys({"left": Inner, "right": Share}, required=("left",))] | None = None


@pytest.mark.parametrize(
    "settings",
    [
        {"sizes": [0, 0.5, 1], "pairs": [[1, "a"]], "count": 3, "inner": {"size": 4, "ends": (1, 2.5)}},
        {"options": {"k": 3, "rate": 0.1, "on": True, "what": None, "name": "x"}, "name": "b", "count": None},
        {"by_name": {"right": 0.5, "left": {"size": 3}}},
        {"options": {"deep": {"k": (1, 2)}}, "name": True, "sizes": ()},
    ],
)
def test_what_is_read_without_pydantic_is_what_pydantic_makes_of_it(settings, monkeypatch):
    plain = read_settings(Plain, settings)
    monkeypatch.setattr("gpca.settings._fitted", lambda kind, value: {}[kind])  # nothing fits
    assert repr(read_settings(Plain, settings)) == repr(plain)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nam": "y"}, "nam: unknown; did you mean name?"),
        ({"inner": {"sise": 1}}, "inner.sise: unknown; did you mean size?"),
        ({"by_name": {"left": {}, "up": 1}}, "by_name.up: unknown; choose one of left, right"),
        ({"by_name": {"left": {"sise": 1}}}, "by_name.left.sise: unknown; did you mean size?"),
        ({"by_name": {"right": 0.5}}, "by_name.left: is missing"),
        ({"changes": {"ends": [0, 1]}}, "changes.ends: unknown; choose one of size"),
        ({"inner": None}, "inner: None should be an object"),
        ({"inner": {"size": 36.0}}, "inner.size: 36.0 should be a valid integer"),
        ({"by_name": {"left": {"size": True}}}, "by_name.left.size: True should be a valid integer"),
        ({"inner": {"size": 10**6 + 1}}, "inner.size: 1000001 should be less than or equal to 1000000"),
        ({"inner": {"ends": [0, float("nan")]}}, "inner.ends.1: nan should be a finite number"),
        ({"inner": {"ends": [0]}}, r"inner.ends: \[0\] is too short"),
        ({"inner": {"ends": [2, 1]}}, "inner: ends: are in descending order; swap the two"),
        ({"share": "much"}, "share: 'much' should be a valid number"),
        ({"kinds": []}, "kinds: is empty"),
        ({"kinds": ["a", "a"]}, r"kinds: \['a', 'a'\] holds a value twice"),
        ({"kinds": "a"}, r"kinds: 'a' should be a valid array; give a list: \[a\]"),
        ({"others": [1, 1]}, "others: .* twice"),
        ({"place": 3}, "place: 3 should be a valid string"),
        ({"place": ["a", 3]}, "place"),
    ],
)
def test_what_a_type_does_not_allow_is_one_line(change, message):
    with pytest.raises(InputError, match=f"^config key {message}") as caught:
        read_settings(Outer, SOUND | change, "config key")
    assert "\n" not in str(caught.value)


def test_parts_of_a_class_are_complete_and_changes_are_not():
    for marker, complete in ((part_of(Inner), True), (changes_of(Inner), False)):
        kind = Annotated[dict, marker]
        assert read_settings(kind, {"size": 3, "ends": [0, 1]}) == {"size": 3, "ends": (0, 1)}
        if complete:
            with pytest.raises(InputError, match="setting ends: is missing"):
                read_settings(kind, {"size": 3})
        else:
            assert read_settings(kind, {"size": 3}) == {"size": 3}


def function(source, seed, wide: Count = 1, rate: float = 0.5, shift: float = -1.0, plain=3, **others: ArgumentsOf):
    """Take what it declares; the last is marked below."""


function.__annotations__["others"] = Annotated[Any, ArgumentsOf(Inner)]


class Made:
    def __init__(self, source: str, seed: int, kind: Literal["a", "b"], **more) -> None: ...


@pytest.mark.parametrize(
    ("taker", "settings", "message"),
    [
        (function, {"wide": 2, "rate": 3, "shift": -5, "plain": 0, "size": 4}, None),
        (function, {"wise": 2}, "wise: unknown; did you mean wide?"),
        (function, {"wide": 0}, "wide: 0 should be greater than or equal to 1"),
        (function, {"rate": -1}, "rate: -1 should be greater than or equal to 0"),
        (function, {"plain": 2.5}, "plain: 2.5 should be a valid integer"),
        (function, {"size": 0}, "size: 0 should be greater than or equal to 1"),
        (partial(function, wide=5), {"wide": 0}, "wide: 0 should be"),
        (Made, {"kind": "a", "anything": [1]}, None),
        (Made, {"kind": "c"}, "kind: 'c' should be 'a' or 'b'"),
        (Made, {}, "kind: is missing"),
    ],
)
def test_settings_of_a_function_are_its_arguments(taker, settings, message):
    if message is None:
        require_arguments("thing 'x'", taker, 2, settings)
        return
    with pytest.raises(InputError, match=f"^thing 'x': setting {message}"):
        require_arguments("thing 'x'", taker, 2, settings)


def test_the_settings_of_several_classes_are_taken_out_of_a_section():
    @dataclass(frozen=True)
    class Others:
        role: str = "final"

    section = {"size": 3, "role": "development", "methods": {}}
    assert fields_of(section, Inner) == {"size": 3}
    assert fields_of(section, Inner, Others) == {"size": 3, "role": "development"}
