"""Readings of Table VI that other rows of depth frames give: their values stand in the place of the judged rows'."""

from dataclasses import replace

import pytest

from gpca.attribution.predictions import write_predictions
from gpca.attribution.scores import Attribution
from gpca.experiments.specification_curve import frame_rows
from gpca.pairs.perturbation import CONCEPTS
from tests.experiments.specification_curve.conftest import rows_of

OBJECTS = ["all", "seen", "unseen"]
FRAMES = {"source": "tiny", "methods": ["dgcnn-none", "pointnext-none"], "estimated": "tiny_estimated"}


@pytest.fixture
def frame_files(run_files, embedded, tmp_path):
    """A wide DGCNN that names every sample rightly, and what DGCNN names from estimators' poses: noise for all."""
    moved = replace(embedded, axes=("tiny_estimated", 0))
    paths = {name: tmp_path / f"{name}.csv" for name in ("wide", "estimated")}
    scores_S_3 = 0.8 * (embedded.concept[:, None] == CONCEPTS) + 0.1
    write_predictions(paths["wide"], embedded, Attribution.of_scores(CONCEPTS, scores_S_3, seconds=0.0))
    scores_S_3[:] = [0.8, 0.1, 0.1]
    write_predictions(paths["estimated"], moved, Attribution.of_scores(CONCEPTS, scores_S_3, seconds=0.0))
    moved.save(tmp_path / "estimated.npz")
    judged = run_files.predictions["tiny", "gpca_paper", 0]  # right but for the first of each concept
    return replace(
        run_files,
        registrations=run_files.registrations | {("tiny_estimated", 0): tmp_path / "estimated.npz"},
        predictions={
            ("tiny", "dgcnn-none", 0): judged,
            ("tiny", "pointnext-none", 0): judged,
            ("tiny", "wide-none", 0): paths["wide"],
            ("tiny_estimated", "dgcnn-none", 0): paths["estimated"],
        },
        settings={"frames": FRAMES, "published": {"dgcnn": "wide"}},
    )


def accuracies(found):
    return {key[:2]: value for key, value in found.items() if key[2:] == ("accuracy", "all")}


def test_an_encoder_as_published_stands_in_the_place_of_the_judged_one(frame_files):
    found = accuracies(
        rows_of(frame_rows.encoders, frame_files, {"architecture": ["judged", "published"], "objects": OBJECTS})
    )
    assert found[("judged", "all"), "dgcnn-none"] == pytest.approx(15 / 18)
    assert found[("published", "all"), "dgcnn-none"] == 1
    assert (("published", "all"), "pointnext-none") not in found  # it has none
    assert {reading[1] for reading, _ in found} == {"all", "seen"}  # training saw every object


def test_the_same_rows_from_estimators_poses(frame_files):
    choices = {"initial_pose": ["true_pose", "estimated"], "objects": ["all"]}
    found = accuracies(rows_of(frame_rows.starts, frame_files, choices))
    assert found[("true_pose", "all"), "dgcnn-none"] == pytest.approx(15 / 18)
    assert found[("estimated", "all"), "dgcnn-none"] == pytest.approx(1 / 3)
    assert found[("true_pose", "all"), "pointnext-none"] == pytest.approx(15 / 18)
    assert (("estimated", "all"), "pointnext-none") not in found  # the run lacks it
