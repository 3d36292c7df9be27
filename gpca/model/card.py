"""What the card beside a model (``python -m gpca ship``) says that older model files do not."""

from __future__ import annotations

import re
from pathlib import Path

LARGEST_BYTES = 10**6  # of a card; what is larger is none
DIAGNOSED = "diagnosis"  # stands in the row of objects that the diagnosis learned from
_ROW = re.compile(rf"^\| (.+?) \| \d+ \| {DIAGNOSED} \|$", re.MULTILINE)


def titles_of_diagnosis(model: Path) -> tuple[str, ...]:
    """Return the titles of the objects that a model's diagnosis learned from; none where no card says so."""
    card = model.with_suffix(".md")
    if not card.is_file() or card.stat().st_size > LARGEST_BYTES:
        return ()
    return tuple(_ROW.findall(card.read_text(encoding="utf-8", errors="replace")))
