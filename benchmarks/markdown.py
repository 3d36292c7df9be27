"""Numbers that a command measured, on the page of the documentation that shows them."""

from collections.abc import Sequence
from pathlib import Path

from gpca.errors import InputError
from gpca.io.files import whole_file


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return the lines of a Markdown table; all columns but the first are aligned right."""
    lines = [f"| {' | '.join(head)} |", f"|---|{'---:|' * (len(head) - 1)}"]
    return lines + [f"| {' | '.join(map(str, row))} |" for row in rows]


def write_between(page: Path, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between the page's comments `<!-- times of NAME -->` and `<!-- end of NAME -->`.

    Raises:
        InputError: no such page, or it has no such comments.
    """
    if not page.is_file():
        raise InputError(page, "no such page", "name a Markdown file")
    begin, end = f"<!-- times of {name} -->\n", f"<!-- end of {name} -->"
    before, found_begin, rest = page.read_text(encoding="utf-8").partition(begin)
    _, found_end, after = rest.partition(end)
    if not found_begin or not found_end:
        raise InputError(page, f"has no place for {name}", f"add the lines '{begin.strip()}' and '{end}'")
    with whole_file(page) as partial:
        partial.write_text(before + begin + "\n".join(["", *lines, "", ""]) + end + after, encoding="utf-8")
