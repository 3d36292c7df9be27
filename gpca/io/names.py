"""What can name something: a source, an object, a concept, the split of a sample."""

from __future__ import annotations

from unicodedata import category

SPLITS = ("train", "test")
_BREAKS = ("Cc", "Zl", "Zp")  # control characters, and what separates lines and paragraphs


def is_name(text: str) -> bool:
    """Return whether a text can name something: it is not blank, and a line or less."""
    return bool(text.strip()) and not any(category(character) in _BREAKS for character in text)
