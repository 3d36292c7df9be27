"""Words of the code: those of the field, in American spelling, and none of those that a stranger stumbles over."""

import re
from collections import Counter

import pytest

from .documents import ROOT

CODE = sorted([*(ROOT / "gpca").rglob("*.py"), *(ROOT / "baselines").rglob("*.py")])
PAGES = sorted([*(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
# Words, and parts of names, that are not used at all -> a plainer one.
AVOIDED = {
    r"told|untold|said|unsaid": "reported, predicted, given",
    r"taught|untaught": "trained",
    r"learnt": "learned",
    r"lessons?": "training data",
    r"beneath": "below, behind, with",
    r"leavable": "optional",
    r"whence|thence|whereof|thereof": "from which, of it",
    r"the same of": "the noun",
    r"that which": "what",
    r"counts not": "is ignored",
    r"\w*colour\w*|\w*centre|\w*behaviour\w*|\w*neighbour\w*|\w*labell\w*|\w*modell\w*|grey": "American spelling",
    r"\w*(?:normal|initial|optim|regular|general|minim|maxim|summar)is(?:e|ed|es|ing|ation)": "American spelling",
}
# Keys of configs and of files keep their spelling, and so does a page's HTML.
KEYS = re.compile(
    r"inverse_regularisation|\bneighbours\b|\"labelled\"|colour\b|\"taught\"|id=\"said\"|\blearnt_from\b"
    r"|\bto_centre\b|\"told the cause\""
)
# Number of names that only point at another one. Lower it, never raise it.
MOST_POINTING = 383
POINTING = re.compile(r"\b(?:of_[a-zA-Z_]+|own|found|places|known)\b")


def words_of(path):
    text = KEYS.sub("", path.read_text(encoding="utf-8")).replace("_", " ")
    for pattern, better in AVOIDED.items():
        for word in re.findall(rf"(?<![\w.]){pattern}(?!\w)", text, re.IGNORECASE):
            yield word.lower(), better


@pytest.mark.parametrize("path", CODE, ids=lambda path: str(path.relative_to(ROOT)))
def test_code_is_in_plain_words(path):
    assert dict(words_of(path)) == {}


def test_names_that_only_point_at_others_get_fewer():
    counts = Counter()
    for path in CODE:
        names = re.sub(r'"""(?:.|\n)*?"""|#[^\n]*|"[^"\n]*"', "", path.read_text(encoding="utf-8"))
        counts[path.parent.relative_to(ROOT).parts[:2]] += len(POINTING.findall(names))
    assert sum(counts.values()) <= MOST_POINTING, counts.most_common()
