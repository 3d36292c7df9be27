"""The file of the paper's sentences: what it holds, and what is refused."""

from collections import Counter

import pytest
import yaml

from gpca.comparison.claims import CLAIMS, PREDICTIONS, TESTS, read_claims
from gpca.comparison.clusters import folders_behind
from gpca.comparison.published import read_published
from gpca.errors import InputError

CLAIM = {
    "name": "best", "sentence": "Ours is best.", "place": "Sec. IV", "test": "greater", "margin": 1, "unit": "%",
    "of": {"in_file": "metrics.csv", "in_table": "attribution", "source": ["ycb", "linemod"], "metric": "accuracy",
           "concept": "all"},
    "comparisons": [{"one": "a", "others": ["b", 50]}],
}  # fmt: skip


def read(tmp_path, *entries):
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump(list(entries)))
    return read_claims(path)


def test_every_kind_of_test_is_used_and_what_is_not_run_says_why():
    claims = read_claims()
    assert set(Counter(claim.test for claim in claims)) == {*TESTS, ""}
    assert all(claim.note for claim in claims if not claim.compared)
    assert [claim.name for claim in claims if not all((claim.name, claim.sentence, claim.place))] == []


def test_calibration_is_asked_for_where_predictions_are_read_anyhow():
    folders = set(folders_behind(read_published()))
    places = [place for claim in read_claims() for compared in claim.compared for place in compared.counterparts]
    asked = {("predictions", place.sources[0], place.methods[0]) for place in places if place.file == PREDICTIONS}
    assert asked
    assert asked <= folders


def test_a_claim_is_compared_in_every_source(tmp_path):
    [claim] = read(tmp_path, CLAIM)
    assert [(c.one.sources, c.one.methods, getattr(c.other, "methods", c.other)) for c in claim.compared] == [
        (("ycb",), ("a",), ("b",)),
        (("linemod",), ("a",), ("b",)),
        (("ycb",), ("a",), 50.0),
        (("linemod",), ("a",), 50.0),
    ]
    assert len(claim.compared[2].counterparts) == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": 3}, "claim 1 has no name"),
        ({"test": "better"}, "claim best: unknown test 'better'; expected one of greater, less, not_worse, equivalent"),
        ({"unit": "points"}, "claim best: unknown unit 'points'"),
        ({"margin": -1}, "claim best: 'margin' is '-1'; give a number of at least 0"),
        ({"margin": 0.5, "ratio": True}, "claim best: 'margin' is '0.5'; give a number of at least 1"),
        ({"sentence": None, "extra": 1}, "claim best: unknown key 'extra'; use only name, sentence, place, test"),
        ({"of": {"in_file": "metrics.csv"}}, "name its in_file, in_table, source, method, metric, concept"),
        ({"of": CLAIM["of"] | {"in_file": "other.csv"}}, "claim best: unknown in_file 'other.csv'"),
        ({"comparisons": [{"one": "a", "other": "b"}]}, "claim best: has a comparison with the keys one, other"),
    ],
)
def test_a_wrong_claim_is_named(tmp_path, changes, message):
    with pytest.raises(InputError) as fault:
        read(tmp_path, CLAIM | changes)
    assert message in str(fault.value)


def test_a_claim_is_whole_and_stands_once(tmp_path):
    with pytest.raises(InputError, match="claim best: appears twice"):
        read(tmp_path, CLAIM, CLAIM)
    for name in ("margin", "of"):
        with pytest.raises(InputError, match=f"claim best: lacks '{name}'; add it"):
            read(tmp_path, {key: value for key, value in CLAIM.items() if key != name})
    told = {key: CLAIM[key] for key in ("name", "sentence", "place")}
    with pytest.raises(InputError, match="claim best: lacks 'note'"):
        read(tmp_path, told)
    assert read(tmp_path, told | {"note": "nobody ran it"})[0].compared == ()
    with pytest.raises(InputError, match="has no claims"):
        read(tmp_path)
    assert CLAIMS.is_file()
