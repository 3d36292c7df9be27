"""The file of the paper's sentences: what it holds, and which values each of its comparisons is of."""

from datetime import date

import yaml

from gpca.comparison import claims as claims_file
from gpca.comparison.claims import CLAIMS, FIRST_SET, PREDICTIONS, counterparts_of, read_claims
from gpca.comparison.clusters import folders_behind
from gpca.comparison.published import UNITS, read_published
from gpca.io.structured_text import load_own_yaml

from .test_published import FILES

CLAIM = {
    "name": "best", "sentence": "Ours is best.", "place": "Sec. IV", "test": "greater", "margin": 1, "unit": "%",
    "of": {"in_file": "metrics.csv", "in_table": "attribution", "source": ["ycb", "linemod"], "metric": "accuracy",
           "concept": "all"},
    "comparisons": [{"one": "a", "others": ["b", 50]}],
}  # fmt: skip


def test_the_file_keeps_the_rules_of_its_head():
    claims = read_claims()
    assert len({claim.name for claim in claims}) == len(claims)
    assert {claim.test for claim in claims} == {"greater", "less", "not_worse", "equivalent", ""}
    for entry in load_own_yaml(CLAIMS):
        assert entry.keys() >= ({"test", "margin", "unit", "of"} if "comparisons" in entry else {"note"}), entry
    for claim in claims:
        assert all((claim.name, claim.sentence, claim.place)), claim
        assert claim.unit in UNITS if claim.compared else claim.note, claim
        assert claim.margin >= claim.ratio, claim
        assert date.fromisoformat(claim.margin_set) >= date.fromisoformat(FIRST_SET), claim
        assert claim.values_known or claim.margin_set > FIRST_SET, claim
        for place in (place for compared in claim.compared for place in compared.counterparts):
            assert place.file in {*FILES, PREDICTIONS}, claim
            assert all((place.table, *place.sources, *place.methods, *place.metrics, place.concept)), claim


def test_calibration_is_asked_for_where_predictions_are_read_anyhow():
    printed = (number.counterpart for number in read_published())
    folders = set(folders_behind([*printed, *counterparts_of(read_claims())]))
    places = [place for place in counterparts_of(read_claims()) if place.file == PREDICTIONS]
    asked = {("predictions", place.sources[0], place.methods[0]) for place in places}
    assert asked
    assert asked <= folders


def test_a_claim_is_compared_in_every_source(tmp_path, monkeypatch):
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump([CLAIM]))
    monkeypatch.setattr(claims_file, "CLAIMS", path)
    [claim] = read_claims()
    assert [(c.one.sources, c.one.methods, getattr(c.other, "methods", c.other)) for c in claim.compared] == [
        (("ycb",), ("a",), ("b",)),
        (("linemod",), ("a",), ("b",)),
        (("ycb",), ("a",), 50.0),
        (("linemod",), ("a",), 50.0),
    ]
    assert len(claim.compared[2].counterparts) == 1
