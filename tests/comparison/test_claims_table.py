import pandas as pd
import pytest

from gpca.comparison.claims import CLAIM_COLUMNS, claims
from gpca.errors import InputError

OF_CLAIM = {"claim": "best", "sentence": "Ours is best.", "place": "Sec. IV", "test": "greater", "unit": "%",
            "margin": "1", "ratio": "False", "table": "learners/in_distribution", "one": "a", "other": "b", "n": 5.0,
            "note": "", "claim_verdict": "refuted", "at_floor": "False",
            "margin_set": "2026-11-22", "values_known": "True"}  # fmt: skip
ROWS = [
    OF_CLAIM | {"source": "ycb", "value": 2.0, "low": 1.5, "high": 2.5, "verdict": "supported"},
    OF_CLAIM | {"source": "cups", "value": -2.0, "low": -2.5, "high": -1.5, "verdict": "refuted"},
    OF_CLAIM | {"claim": "fewer", "sentence": "It needs less.", "test": "less", "unit": "labels", "margin": "1.25",
                "ratio": "True", "source": "ycb", "value": 0.5, "low": 0.4, "high": 0.625, "verdict": "supported",
                "claim_verdict": "supported", "margin_set": "2026-11-24", "values_known": "False"},
    OF_CLAIM | {"claim": "at once", "sentence": "It is quick.", "source": "ycb", "value": 1.0, "low": 1.0, "high": 1.0,
                "verdict": "inconclusive", "claim_verdict": "inconclusive", "at_floor": "True", "one": "a overlap"},
    {"claim": "open", "test": "", "sentence": "It works.", "place": "Sec. V", "verdict": "not run",
     "claim_verdict": "not run", "note": "nobody ran it"},
]  # fmt: skip
SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}


def table(rows=ROWS):
    return claims(pd.DataFrame(rows, columns=list(CLAIM_COLUMNS)), SOURCES, {"a": "Ours"})


def test_a_sentence_stands_once_above_its_comparisons():
    page = table().markdown()
    assert (
        "| Ours is best. (Sec. IV) | refuted | YCB | in distribution | Ours against b | greater, by 1 % | supported | "
        "2 (1.5 to 2.5) |" in page
    )
    assert "|  |  | Cups (procedural stand-in) | in distribution | Ours against b |" in page
    assert "less, by × 1.25 | supported | 0.5 (0.4 to 0.625) |" in page
    assert "1 supported, 1 refuted, 1 inconclusive, 1 not run" in page
    assert "It works. (Sec. V): nobody ran it." in page
    assert "| Ours overlap against b | greater, by 1 % | inconclusive (floor) |" in page
    assert "over 5 seeds" in page
    assert "nan" not in page
    words = "Margins were set for 2 on 2026-11-22, after the differences had been seen; 1 on 2026-11-24, before"
    assert words in table().markdown()
    records = table().records()
    assert records[3][-6:] == (0.5, 0.4, 0.625, 5, 0, False)
    with pytest.raises(InputError, match="has nothing to show"):
        table(ROWS[-1:])
