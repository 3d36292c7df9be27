"""Pairs of which nothing that a model says means anything: the state is unknown, and there is something to check."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gpca import Explainer
from gpca.model.diagnoser import UNKNOWN
from gpca.model.explanation import CHECK, WORDS
from gpca.model.voids import voids_of
from gpca.objects.canonical import canonical_cloud
from gpca.objects.procedural import FAMILIES, surfaces

FAR = np.array([[9.0, 0, 0]])
PAIRS = {
    "a source elsewhere": (lambda s, t: (s + 5, t), "no source point ended near the target", "the initial pose"),
    "a source 4 times as large": (lambda s, t: (4 * s, t), "source and target differ in scale", "unit and scale"),
    "a source 6.5 times as large": (lambda s, t: (6.5 * s, t), "source and target differ in scale", "unit and scale"),
    "a source a seventh as large": (lambda s, t: (s / 7, t), "source and target differ in scale", "unit and scale"),
    "a far point in both": (lambda s, t: (np.r_[s, FAR], np.r_[t, FAR]), "98% of the target's points", "points far"),
}


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("threshold", [0.0, 2.0])  # of a model that calls everything failed, and nothing
def test_nothing_is_said_of_a_pair_without_meaning(name, threshold, model, pair):
    change, fault, check = PAIRS[name]
    diagnoser = replace(model.diagnoser, threshold=threshold)
    said = Explainer(replace(model, diagnoser=diagnoser), device="cpu").explain(*change(*pair))
    assert said.unknown
    assert (said.diagnosis.state, said.diagnosis.named, said.action) == (UNKNOWN, (), CHECK)
    assert check in said.reason
    assert any(line.startswith(fault) and "the scores are meaningless: check " in line for line in said.warnings)
    plain = json.loads(json.dumps(said.as_dict()))
    assert (plain["diagnosis"]["state"], plain["action"]) == ("unknown", "check")
    text = said.text()
    assert f"state     unknown\naction    {WORDS[CHECK]} ({said.reason})\n" in text
    for word in ("nominal", "failed", "probability", "variance", "score "):
        assert word not in text


def test_gpca_alone_knows_nothing_of_such_a_pair_either(explainer, pair):
    source, target = pair
    said = explainer.explain(source + 5, target, diagnose=False)
    assert said.unknown
    assert said.action == CHECK
    assert "state     unknown" in said.text()


def test_what_can_be_judged_is_not_void(explainer, pair):
    source, target = pair
    for known in (source, 1.3 * source, source[: len(source) // 2], np.r_[source, [[0.3, 0, 0]]]):
        assert not explainer.explain(known, target).unknown
    near = source / np.linalg.norm(np.ptp(source, axis=0))
    (void,) = voids_of(near, near, 2 / len(near), None)
    assert str(void).startswith("only 2 of the source's points ended near the target, so")
    assert voids_of(near, near, 3 / len(near), None) == []


@pytest.mark.parametrize("family", FAMILIES)
def test_the_diameter_of_no_object_is_made_up_of_a_few_points(family):
    for surface in surfaces(family):
        points, _, diameter_m = canonical_cloud(surface, family, 2048)
        assert voids_of(points / diameter_m, points / diameter_m, 1.0, None) == []
