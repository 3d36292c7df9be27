"""YAML and JSON files of users: within limits, without repeated keys, with plain values only."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file

if TYPE_CHECKING:
    import yaml

LARGEST_CONFIG_BYTES = 2**18  # fifteen times the longest config of the suite
MOST_ENTRIES = 100_000  # with all aliases expanded; the suite's configs have a thousand
_MERGE = "tag:yaml.org,2002:merge"
# Scalars that YAML 1.1 and 1.2 read alike; others are refused as ambiguous. By YAML 1.1, which PyYAML and Snakemake
# read, 12:30 is 750, 010 is 8, 1_000 is 1000 and `no` is false.
_ALIKE = {
    int: re.compile("[-+]?(0|[1-9][0-9]*|0x[0-9a-fA-F]+)"),
    float: re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"),
    bool: re.compile("true|True|TRUE|false|False|FALSE"),
    type(None): re.compile("|~|null|Null|NULL"),
}
_UNPRINTABLE = r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]"  # control characters, and halves of a surrogate pair
LARGEST_JSON_BYTES = 2**26  # ten times the largest scene of the BOP benchmark


def load_own_yaml(path: Path) -> Any:
    """Return the content of a YAML file of the package, by libyaml if available, in a fifth of the time."""
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return yaml.load(path.read_text(encoding="utf-8"), Loader=loader)


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Return the mapping in a YAML or JSON file; InputError for repeated keys, ambiguous scalars, endless aliases."""
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
    """Return the number, boolean or null that every YAML version reads in a text, else the text."""
    import yaml

    try:
        value = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):  # a name or a path
        return text
    alike = _ALIKE.get(type(value))
    return value if alike and alike.fullmatch(text.strip()) else text


def require_plain(part: Mapping | list, subject: object, path: tuple = ()) -> None:
    """Raise an InputError for a key that is not text, a value that JSON lacks, or a control character in a text."""
    for name, value in part.items() if isinstance(part, Mapping) else enumerate(part):
        key = ".".join(map(str, (*path, name)))
        if isinstance(part, Mapping) and not isinstance(name, str):
            raise InputError(f"{subject} {key}", f"the key {name!r} is not text", f'write "{name}", in quotes')
        for text in (name, value):
            if isinstance(text, str) and re.search(_UNPRINTABLE, text):
                raise InputError(f"{subject} {key!r}", f"{text!r} contains a control character", "write it on one line")
        if isinstance(value, Mapping | list):
            require_plain(value, subject, (*path, name))
        elif not (value is None or isinstance(value, str | int | float)):
            raise InputError(f"{subject} {key}", f"{value!r} is a {type(value).__name__}", "put it in quotes")


def _parse_yaml(text: str, path: Path) -> Any:
    import yaml

    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        # Before aliases are expanded.
        if _size(node, {}, path) > MOST_ENTRIES:
            raise InputError(path, f"its aliases expand to more than {MOST_ENTRIES} entries", "write the entries out")
        return loader.construct_document(node)
    except RecursionError as fault:
        raise InputError(path, "is nested too deeply", "nest it less") from fault
    except InputError:
        raise
    except (yaml.YAMLError, ValueError) as fault:  # also an impossible date or number
        raise InputError(path, f"is neither YAML nor JSON: {fault}", "correct it there") from fault


def _size(node: yaml.Node, sizes: dict[int, int | None], path: Path) -> int:
    import yaml

    line = f"line {node.start_mark.line + 1}"
    if isinstance(node, yaml.ScalarNode):
        if node.tag != _MERGE:
            value = yaml.constructor.SafeConstructor().construct_object(node)
            if (alike := _ALIKE.get(type(value))) and not alike.fullmatch(node.value):
                remedy = f'write {json.dumps(value)}, or "{node.value}" in quotes'
                raise InputError(f"{path}: {line}", f"YAML 1.1 reads {node.value} as {value}", remedy)
        return 1
    if (size := sizes.get(id(node), 0)) is None:
        raise InputError(path, f"{line}: the value that begins here contains itself", "remove the alias")
    if size:
        return size
    sizes[id(node)] = None  # in progress
    parts = node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
    size = 1 + sum(_size(part, sizes, path) for part in parts)
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != _MERGE:
                if (key.tag, key.value) in seen:
                    fault = f"line {key.start_mark.line + 1}: key '{key.value}' appears twice"
                    raise InputError(path, fault, "keep one of them")
                seen.add((key.tag, key.value))
    sizes[id(node)] = size
    return size


def read_json(path: Path, what: str, remedy: str) -> dict[str, Any]:
    """Return the object in a JSON file; InputError, "is not `what`", for a damaged one."""
    require_file(path, "no such file", remedy, LARGEST_JSON_BYTES)
    with refusing(path, f"is not {what} ({{}})", remedy):
        content = parse_json(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise InputError(path, f"is not {what} (its top level is not an object)", remedy)
    return content


def parse_json(text: str) -> Any:
    """Return the value of a JSON text; ValueError for none (a JSONDecodeError), a repeated key, NaN or infinity."""

    def without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        content = dict(pairs)
        if len(content) < len(pairs):
            twice = next(key for n, (key, _) in enumerate(pairs) if key in dict(pairs[:n]))
            raise ValueError(f"key {twice[:40]!r} appears twice")
        return content

    def no_constant(name: str) -> NoReturn:
        raise ValueError(f"{name} is not a number")

    try:
        return json.loads(text, object_pairs_hook=without_duplicates, parse_constant=no_constant)
    except RecursionError as fault:
        raise ValueError("nested too deeply") from fault


def finite_numbers(value: Any, count: int, subject: object, name: str, remedy: str) -> np.ndarray:
    """Return the numbers of a list, or a list of rows; a single number needs no list. InputError for anything else."""
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
