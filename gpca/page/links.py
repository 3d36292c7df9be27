"""Makes links of what a text names: pages of ``docs/``, files beside the page, tables and figures that stand on it."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path

DOCS = "../../docs"  # from the folder of a run in a checkout, results/{run}
# What is a link already, and tags, stay as they are.
_NAMES = re.compile(r"<a\b.*?</a>|<[^>]*>|docs/(?P<page>[a-z_]+\.md)|(?P<word>\w+(?:\.csv)?)\b", re.DOTALL)


class Links:
    """Knows what there is to link to.

    Args:
        folder: of the run.
        results: the names of its tables and figures, which are places on the page.
    """

    def __init__(self, folder: Path, results: Collection[str]) -> None:
        docs = folder / DOCS
        self._pages = {path.name for path in docs.glob("*.md")} if docs.is_dir() else set()
        self._files = {path.name for path in folder.glob("*.csv")}
        self._results = {name for name in results if "_" in name}  # the others are words of the language too

    def in_text(self, text: str, own: str = ""):
        """Return a text as HTML: escaped, what stands in backticks as code, and with links.

        Args:
            own: name of the table or figure that the text belongs to, which is no link there.
        """
        from markupsafe import Markup, escape

        parts = str(escape(text)).split("`")
        return self.in_html(
            Markup("".join(f"<code>{part}</code>" if k % 2 else part for k, part in enumerate(parts))), own
        )

    def in_html(self, html, own: str = ""):
        """Return HTML with links; ``own`` is as in :meth:`in_text`."""
        from markupsafe import Markup

        def linked(found: re.Match) -> str:
            page, word = found["page"], found["word"]
            if page in self._pages:
                return f'<a href="{DOCS}/{page}">docs/{page}</a>'
            if word in self._files:
                return f'<a href="{word}">{word}</a>'
            return f'<a href="#{word}">{word}</a>' if word in self._results and word != own else found[0]

        return Markup(_NAMES.sub(linked, str(html)))
