"""YAML and JSON files of others: read within bounds, without repeated keys, and with plain values alone."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import yaml

from gpca.errors import InputError
from gpca.io.limits import require_file

LARGEST_CONFIG_BYTES = 2**18  # fifteen times the longest config of the suite; PyYAML reads it within seconds
MOST_ENTRIES = 100_000  # with every alias unfolded; the configs of the suite have a thousand
_MERGE = "tag:yaml.org,2002:merge"
# What every YAML reads alike. PyYAML, and with it Snakemake, reads by YAML 1.1 more than most people know of: 12:30 is
# 750, 010 is 8, 1_000 is 1000 and `no` is false. What is written so is refused, since what was meant is anyone's guess.
_ALIKE = {
    int: re.compile("[-+]?(0|[1-9][0-9]*|0x[0-9a-fA-F]+)"),
    float: re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"),
    bool: re.compile("true|True|TRUE|false|False|FALSE"),
    type(None): re.compile("|~|null|Null|NULL"),
}
LARGEST_JSON_BYTES = 2**26  # ten times the largest scene of the BOP benchmark; parsed, it takes ten times the memory


def load_own_yaml(path: Path) -> Any:
    """Return what a YAML file of the package holds; libyaml takes a fifth of the time, where PyYAML has it."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return yaml.load(path.read_text(encoding="utf-8"), Loader=loader)


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Return the mapping that a YAML or JSON file holds.

    Raises:
        InputError: no such file, too large, not UTF-8, neither YAML nor JSON, no mapping, a key that stands twice,
            a number or switch that YAML 1.1 alone has (`_ALIKE`), aliases that unfold to more than `MOST_ENTRIES` or to
            themselves, or what :func:`require_plain` refuses.
    """
    path = Path(path)
    require_file(path, "no such file", "name a config, a YAML or JSON file", LARGEST_CONFIG_BYTES)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as fault:
        raise InputError(path, f"is not UTF-8 (byte {fault.start})", "save it as UTF-8") from fault
    try:
        mapping = parse_json(text)
    except json.JSONDecodeError:
        mapping = _parse_yaml(text, path)
    except ValueError as fault:
        raise InputError(path, str(fault), "correct it there") from fault
    if not isinstance(mapping, dict):
        raise InputError(path, "has no keys at its top level", "write 'key: value', as in config/config.yaml")
    require_plain(mapping, path)
    return mapping


def read_scalar(text: str) -> Any:
    """Return the number, the boolean or the null that a text is in every YAML, else the text itself."""
    try:
        value = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):  # a name or a path
        return text
    alike = _ALIKE.get(type(value))
    return value if alike and alike.fullmatch(text.strip()) else text


def require_plain(mapping: Mapping, subject: object) -> None:
    """Raise an InputError for a key that is not text, and for a value that JSON cannot express.

    Texts with line breaks or other control characters are refused too: they would end up in file names and tables.
    """
    for path, value in _entries(mapping):
        key = ".".join(map(str, path))
        if not isinstance(path[-1], str | _Index):
            raise InputError(f"{subject} {key}", f"the key {path[-1]!r} is not text", f'write "{path[-1]}", in quotes')
        for text in (path[-1], value):
            if isinstance(text, str) and not _printable(text):
                raise InputError(f"{subject} {key!r}", f"{text!r} contains a control character", "write it on one line")
        if not (value is None or isinstance(value, str | int | float | Mapping | list)):
            raise InputError(f"{subject} {key}", f"{value!r} is a {type(value).__name__}", "put it in quotes")


class _Index(int):
    """Place in a list."""


def _entries(value: Any, path: tuple = ()) -> Iterator[tuple[tuple, Any]]:
    if isinstance(value, Mapping | list):
        pairs = value.items() if isinstance(value, Mapping) else ((_Index(i), entry) for i, entry in enumerate(value))
        for key, entry in pairs:
            yield (*path, key), entry
            yield from _entries(entry, (*path, key))


def _printable(text: str) -> bool:
    """Return whether a text has no control character of ASCII or Unicode and no half of a surrogate pair."""
    return not any(ord(letter) < 32 or 127 <= ord(letter) < 160 or 0xD800 <= ord(letter) < 0xE000 for letter in text)


def _parse_yaml(text: str, path: Path) -> Any:
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        # On the nodes, before any alias is unfolded.
        if _size(node, {}, path) > MOST_ENTRIES:
            raise InputError(path, f"its aliases expand to more than {MOST_ENTRIES} entries", "write the entries out")
        return loader.construct_document(node)
    except RecursionError as fault:
        raise InputError(path, "is nested too deeply", "nest it less") from fault
    except InputError:
        raise
    except (yaml.YAMLError, ValueError) as fault:  # a date or a number may look like one and be none
        raise InputError(path, f"is neither YAML nor JSON: {fault}", "correct it there") from fault


def _size(node: yaml.Node, sizes: dict[int, int | None], path: Path) -> int:
    """Return how many entries a node has with all aliases unfolded."""
    place = f"line {node.start_mark.line + 1}"
    if isinstance(node, yaml.ScalarNode):
        _require_alike(node, f"{path}: {place}")
        return 1
    if (known := sizes.get(id(node), 0)) is None:
        raise InputError(path, f"{place}: the value that begins here contains itself", "remove the alias")
    if known:
        return known
    sizes[id(node)] = None  # on the way
    parts = node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
    size = 1 + sum(_size(part, sizes, path) for part in parts)
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != _MERGE:
                if (key.tag, key.value) in seen:
                    line = key.start_mark.line + 1
                    raise InputError(path, f"line {line}: key '{key.value}' appears twice", "keep one of them")
                seen.add((key.tag, key.value))
    sizes[id(node)] = size
    return size


def _require_alike(node: yaml.ScalarNode, place: str) -> None:
    if node.tag == _MERGE:
        return
    value = yaml.constructor.SafeConstructor().construct_object(node)
    if (alike := _ALIKE.get(type(value))) and not alike.fullmatch(node.value):
        raise InputError(
            place, f"YAML 1.1 reads {node.value} as {value}", f'write {json.dumps(value)}, or "{node.value}" in quotes'
        )


def read_json(path: Path, what: str, remedy: str) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Args:
        what: the kind of file, for the message: "is not `what`".

    Raises:
        InputError: missing, too large, not UTF-8, another type than an object, or what :func:`parse_json` refuses.
    """
    require_file(path, "no such file", remedy, LARGEST_JSON_BYTES)
    try:
        content = parse_json(path.read_text(encoding="utf-8"))
    except ValueError as fault:  # also of UTF-8
        raise InputError(path, f"is not {what} ({fault})", remedy) from fault
    if not isinstance(content, dict):
        raise InputError(path, f"is not {what} (its top level is not an object)", remedy)
    return content


def parse_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        ValueError: no JSON (a JSONDecodeError), nested too deeply, a key that stands twice in an object, of which
            Python would keep the last, or NaN or infinity, which JSON does not have.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_duplicates, parse_constant=_no_constant)
    except RecursionError as fault:
        raise ValueError("nested too deeply") from fault


def finite_numbers(value: Any, count: int, subject: object, name: str, remedy: str) -> np.ndarray:
    """Return the numbers of a list, or of a list of rows; one number may stand by itself.

    Raises:
        InputError: another count, something else than a number, or one that is not finite; it says that `name` has it.
    """
    rows = value if isinstance(value, list) and count > 1 else [value]
    numbers = [number for row in rows for number in (row if isinstance(row, list) and count > 1 else [row])]
    for number in numbers:
        if type(number) not in (int, float):
            raise InputError(subject, f"{name} contains {repr(number)[:40]}, which is not a number", remedy)
        if not abs(number) < 1e300:  # also NaN, and an integer that no float holds
            raise InputError(subject, f"{name} contains a number that is not finite", remedy)
    if len(numbers) != count:
        raise InputError(subject, f"{name} has {len(numbers)} numbers, not {count}", remedy)
    return np.array(numbers, float)


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for key, value in pairs:
        if key in content:
            raise ValueError(f"key {key[:40]!r} appears twice")
        content[key] = value
    return content


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")
