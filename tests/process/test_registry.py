import sys
from importlib import invalidate_caches

import pytest

from gpca.errors import InputError
from gpca.process.registry import Registry


@pytest.fixture
def fruits(tmp_path, monkeypatch):
    """A folder of two modules with entries and one without, besides a module elsewhere."""
    (tmp_path / "fruits").mkdir()
    files = {"fruits/__init__": "", "fruits/red": "FRUITS = {'cherry': 1, 'apple': 2}", "fruits/tools": "CORER = 0"}
    files |= {"fruits/blue": "FRUITS = {'plum': 3}", "exotic": "FRUITS = {'mango': 4}"}
    for name, text in files.items():
        (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    yield Registry("fruit", "fruits", "FRUITS", first=("exotic",))
    for name in [name for name in sys.modules if name.split(".")[0] in ("fruits", "exotic")]:
        del sys.modules[name]


def test_entries_are_found_in_all_modules_in_their_order_and_in_a_new_file(fruits, tmp_path):
    assert list(fruits.entries().items()) == [("mango", 4), ("plum", 3), ("cherry", 1), ("apple", 2)]
    assert fruits.entry("apple") == 2
    assert (fruits.module("apple"), fruits.module("mango")) == ("fruits.red", "exotic")
    assert "lime" not in fruits.entries()
    (tmp_path / "fruits/green.py").write_text("FRUITS = {'lime': 5}")
    invalidate_caches()
    assert fruits.module("lime") == "fruits.green"


@pytest.mark.parametrize("ask", ["entry", "module"])
def test_an_unknown_name_is_answered_with_the_known(fruits, ask):
    with pytest.raises(InputError, match="fruit 'pear': unknown; choose one of mango, plum, cherry, apple"):
        getattr(fruits, ask)("pear")
