"""Reasons that quote the run: what stands in braces in them is a value of a tidy file, filled in for each run.

``{metrics.csv attribution @ gpca accuracy all %}`` names file, table, source, method, metric and concept (of
``runtime.csv``: components, model, component, seconds and device), as published.csv does, and the unit. An ``@`` stands
for what the printed number's own counterpart has in that place.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from gpca.comparison.published import UNITS, Counterpart, Number
from gpca.comparison.values import Reproduced, value_of_run

if TYPE_CHECKING:
    import pandas as pd

OWN = "@"
FIELDS = ("file", "table", "source", "method", "metric", "concept", "unit")
_CITATION = re.compile(r"\{([^{}]+)\}")
_SENTENCES = re.compile(r"(?<=\.) (?=[A-Z])")


def citations(text: str) -> list[dict[str, str]]:
    """Return what a reason cites, field by field.

    Raises:
        ValueError: a citation that lacks a field, or has an unknown unit.
    """
    cited = []
    for words in _CITATION.findall(text):
        fields = dict(zip(FIELDS, words.split(), strict=True))
        if fields["unit"] not in UNITS:
            raise ValueError(f"unknown unit in {{{words}}}")
        cited.append(fields)
    return cited


def cited_number(number: Number, fields: Mapping[str, str]) -> Number | None:
    """Return the number whose value a citation gives in a reason for `number`; None where that has no counterpart."""
    if (own := number.counterpart) is None:
        return None
    counterpart = Counterpart(
        file=fields["file"],
        table=_or_own(fields["table"], own.table),
        sources=own.sources if fields["source"] == OWN else (fields["source"],),
        methods=own.methods if fields["method"] == OWN else (fields["method"],),
        metrics=own.metrics if fields["metric"] == OWN else (fields["metric"],),
        concept=_or_own(fields["concept"], own.concept),
        statistic=own.statistic,
    )
    return replace(number, unit=fields["unit"], counterpart=counterpart)


def filled(text: str, number: Number, results: Mapping[str, pd.DataFrame]) -> str:
    """Return a reason for a number with the values of a run; sentences that cite what the run lacks are left out."""
    sentences = []
    for sentence in _SENTENCES.split(text):
        values = []
        for fields in citations(sentence):
            cited = cited_number(number, fields)
            value = value_of_run(cited, results) if cited else None
            if value is None:
                break
            values.append(_in_words(value, fields["unit"]))
        else:
            quoted = iter(values)
            sentences.append(_CITATION.sub(lambda _, quoted=quoted: next(quoted), sentence))
    return " ".join(sentences)


def _or_own(word: str, own: str) -> str:
    return own if word == OWN else word


def _in_words(value: Reproduced, unit: str) -> str:
    text = {"%": f"{value.value:.1f}", "labels": f"{value.value:.0f}", "epochs": f"{value.value:.0f}"}.get(
        unit, f"{value.value:.2g}"
    )
    return f"more than {text}" if value.at_least else text
