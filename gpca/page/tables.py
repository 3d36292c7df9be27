"""Arranges a printed table for the page: what many rows share is said once, above them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby

FEWEST = 2  # rows that share a first label, on average, from which it stands above them


def in_groups(printed: Mapping) -> dict:
    """Return a printed table (:meth:`gpca.reporting.tables.table.Table.printed`) with its rows in groups.

    Rows that follow one another with the same first label, such as the dataset, are a group whose ``title`` has it, and
    no longer hold it. Where there are few such rows, the same label comes back later, or it is the only one, all rows
    are one group without a title.
    """
    rows, labels = printed["rows"], printed["label_columns"]
    runs = [(first, list(of)) for first, of in groupby(rows, key=lambda row: row[0][0])]
    if labels < 2 or len({first for first, _ in runs}) < len(runs) or len(rows) < FEWEST * len(runs):
        return dict(printed) | {"groups": [{"title": "", "rows": rows}]}
    head = printed["heads"][0]
    groups = [{"title": f"{head}: {first}", "rows": [row[1:] for row in of]} for first, of in runs]
    return dict(printed) | {"heads": printed["heads"][1:], "label_columns": labels - 1, "groups": groups}
