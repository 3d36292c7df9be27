import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.causes.settings import CauseSettings, Limits
from gpca.causes.truth import ALL, BY_SIZE
from gpca.errors import InputError
from gpca.experiments.registration_stages import source_before_icp
from gpca.page.samples import (
    OF_EACH_CONCEPT,
    POINTS,
    cause_samples,
    first_of_each_cause,
    first_of_each_concept,
    page_samples,
)
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import inverse, transform
from tests.conftest import FEW_CAUSES
from tests.figures import write_uncertainties

from ..model.test_page import unpacked

SOURCE = {"title": "Bricks", "stand_in": True}


LIMITS, REACH = Limits(nominal=0.02, failed=0.03), 0.1


@pytest.fixture
def files(registrations, predicted, tmp_path):
    return predicted(registrations, tmp_path)


@pytest.fixture
def samples(files):
    return page_samples(files, SOURCE, LIMITS, REACH)


def drawn(sample, T=None):
    """The source of a scene in a pose; or, by default, where the registration began."""
    points = unpacked(sample["scene"]["source"])
    return points if T is None else transform(np.reshape(T, (4, 4)), points)


def centered(points, registrations, row):
    """Points of a row in the frame of the view, whose origin is in the middle of the target."""
    target = registrations.target(row)
    return points - (target.min(axis=0) + target.max(axis=0)) / 2


def test_the_first_test_samples_of_each_concept_are_shown(registrations):
    shuffled = registrations.subset(np.random.default_rng(0).permutation(len(registrations)))
    rows = first_of_each_concept(shuffled)
    assert shuffled.concept[rows].tolist() == [c for c in CONCEPTS for _ in range(OF_EACH_CONCEPT)]
    assert set(shuffled.split[rows]) == {"test"}
    for concept in CONCEPTS:
        numbers = np.sort(shuffled.sample[(shuffled.concept == concept) & (shuffled.split == "test")])
        of_concept = [row for row in rows if shuffled.concept[row] == concept]
        assert shuffled.sample[of_concept].tolist() == numbers[:OF_EACH_CONCEPT].tolist()


def test_the_clouds_are_those_of_the_file_in_all_three_poses(samples, registrations):
    for sample, row in zip(samples, first_of_each_concept(registrations), strict=True):
        scene, cloud = sample["scene"], registrations.cloud(row)
        assert len(cloud) < POINTS  # so that none is left out
        target = centered(registrations.target(row), registrations, row)
        np.testing.assert_allclose(unpacked(scene["target"]), target, atol=1e-3)
        T_true_icp = registrations.T_target_source("true", row) @ inverse(registrations.T_target_source("icp", row))
        [truth] = scene["poses"]
        for points, expected in (
            (drawn(sample), source_before_icp(registrations, row)),
            (drawn(sample, scene["found"]), cloud),
            (drawn(sample, truth["T"]), transform(T_true_icp, cloud)),
        ):
            np.testing.assert_allclose(points, centered(expected, registrations, row), atol=1e-3)
        assert truth["what_ifs"] == []
        assert (scene["reach"], scene["titles"]) == (REACH, {"pose:0": "In the true pose"})


def test_scores_and_deviations_are_those_of_the_predictions(samples, files):
    rows = pd.read_csv(files["predictions"])
    rows = rows[rows["split"] == "test"].set_index("sample")
    for sample in samples:
        row = rows.loc[sample["sample"]]
        assert sample["predicted"] == row["concept_predicted"]
        assert sample["source"] == SOURCE
        for score in sample["scores"]:
            assert score["mean"] == pytest.approx(row[f"score_{score['concept']}"], abs=5.1e-4)
            assert score["deviation"] == pytest.approx(np.sqrt(row[f"variance_{score['concept']}"]), abs=5.1e-4)


def test_an_abstention_has_no_scores_and_predictions_of_other_samples_are_refused(files):
    rows = pd.read_csv(files["predictions"], dtype=str, keep_default_na=False)
    rows["abstained"], rows["concept_predicted"] = "True", ""
    rows[[f"score_{c}" for c in CONCEPTS]] = ""
    rows.to_csv(files["predictions"], index=False)
    shown = page_samples(files, SOURCE, LIMITS, REACH)
    assert {sample["predicted"] for sample in shown} == {""}
    assert {score["mean"] for sample in shown for score in sample["scores"]} == {None}
    rows[rows["split"] == "train"].to_csv(files["predictions"], index=False)
    with pytest.raises(InputError, match=r"seed0\.csv: lacks test sample \d+ of .*; regenerate both"):
        page_samples(files, SOURCE, LIMITS, REACH)


def test_the_page_says_how_far_off_icp_ends(samples, registrations):
    for sample, row in zip(samples, first_of_each_concept(registrations), strict=True):
        target = registrations.target(row).astype(float)
        T_off = registrations.T_target_source("icp", row) @ inverse(registrations.T_target_source("true", row))
        off = np.linalg.norm(transform(T_off, target) - target, axis=1).mean()
        assert 0 <= sample["error_percent"] <= 100 * off + 1e-3  # ADD-S is never above ADD
        assert sample["state"] == ("nominal" if sample["error_percent"] < 2 else "failed" if sample["error_percent"] > 3
                                   else "borderline")  # fmt: skip
    assert len({sample["state"] for sample in samples}) > 1
    assert {sample["uncertainty"] for sample in samples} == {None}


def test_states_follow_the_limits_and_uncertainties_are_those_of_the_file(files, registrations, tmp_path):
    write_uncertainties(tmp_path / "u.csv", registrations)
    strict = Limits(nominal=1e-6, failed=1e-5)
    for sample in page_samples(files | {"uncertainty": tmp_path / "u.csv"}, SOURCE, strict, REACH):
        assert sample["state"] == "failed"
        assert sample["uncertainty"] == sample["sample"] / 10
        assert sample["clean_uncertainty"] == 1


MEASURED = {"title": "Four", "stand_in": True}
SETTINGS = CauseSettings(**FEW_CAUSES)


@pytest.fixture(scope="module")
def measured(four, causes, tmp_path_factory):
    """The objects of the source, and its causes of seed 100."""
    folder = tmp_path_factory.mktemp("measured")
    causes_npz, objects = folder / "causes/four/seed100.npz", folder / "objects/four.npz"
    replace(causes, registrations=replace(causes.registrations, axes=("four", 100))).save(causes_npz)
    four.save(objects, "four")
    return {"objects": objects, "causes": causes_npz}


@pytest.fixture(scope="module")
def shown(measured):
    return cause_samples(measured, MEASURED, SETTINGS)


def test_the_first_failure_of_each_cause_is_shown(shown, causes):
    rows = first_of_each_cause(causes)
    assert 0 < len(rows) <= len(CONCEPTS)
    assert set(causes.registrations.split[rows]) == {"test"}
    assert set(causes.truth.state[rows]) == {"failed"}
    assert (causes.error_shown[rows] > causes.truth.failed_limit).all()
    assert [sample["concept"] for sample in shown] == causes.truth.dominant[rows].tolist()
    assert len({sample["concept"] for sample in shown}) == len(shown)
    assert first_of_each_cause(causes.subset(causes.rows("train"))) == []


def test_shares_and_errors_are_those_of_the_truth(shown, causes):
    for sample, row in zip(shown, first_of_each_cause(causes), strict=True):
        assert [share["percent"] for share in sample["shares"]] == pytest.approx(100 * causes.truth.phi[row], abs=0.01)
        errors = 100 * causes.truth.error[row, list(BY_SIZE)]
        assert [what_if["percent"] for what_if in sample["what_ifs"]] == pytest.approx(errors, abs=0.01)
        assert sample["what_ifs"][-1]["words"] == "As it was"
        assert sample["limit"] == 100 * SETTINGS.limits.failed
        assert json.loads(json.dumps(sample)) == sample


def test_every_counterfactual_can_be_seen(shown, causes):
    for sample, row in zip(shown, first_of_each_cause(causes), strict=True):
        scene = sample["scene"]
        [pose] = scene["poses"]
        clouds = [pose["what_ifs"][each] if isinstance(each, int) else each for each in pose["what_ifs"]]
        assert len(clouds) == 8
        assert set(scene["titles"]) == {"pose:0", *(f"what:0:{place}" for place in range(8))}
        found = transform(np.reshape(scene["found"], (4, 4)), unpacked(scene["source"]))
        np.testing.assert_allclose(unpacked(clouds[BY_SIZE.index(ALL)]), found, atol=2e-3)
        distinct = 2 ** int(causes.applied[row].sum())
        assert sum(not isinstance(each, int) for each in pose["what_ifs"]) <= distinct


def test_causes_of_other_settings_are_refused(measured):
    with pytest.raises(InputError, match="is not reproduced by these settings"):
        cause_samples(measured, MEASURED, CauseSettings(**FEW_CAUSES | {"points": (64, 128)}))
