"""Readings in words: the values of each group's choices, as :class:`gpca.comparison.readings.Words` wants them."""

import csv
from pathlib import Path

from gpca.steps.readings.groups import GROUPS

ANY_NUMBER = "{}"  # in the place of a value: the words around a number
WORDS: dict[str, dict[str, str]] = {}  # field of a group's choices -> what its values are called
with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
    for row in csv.DictReader(file):
        WORDS.setdefault(row["choice"], {})[row["value"]] = row["words"]


def reading(group: str, name: str) -> str:
    """A reading as words: ``RBF, 100 iterations`` for ``rbf/100`` of ``kernel``; unknown values stay as they are."""
    values, choices = name.split("/"), list(GROUPS[group].choices) if group in GROUPS else []
    return ", ".join(map(value, choices, values) if len(choices) == len(values) else values)


def value(choice: str, name: str) -> str:
    words = WORDS.get(choice, {})
    if name not in words and ANY_NUMBER in words:
        return words[ANY_NUMBER].format(name)
    return " and ".join(words.get(part, part) for part in name.split("+"))


def group(name: str) -> str:
    """What a group leaves open: ``How the GPC starts``; an unknown name stays as it is."""
    return GROUPS[name].title if name in GROUPS else name
