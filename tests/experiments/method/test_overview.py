from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.experiments.method.overview import decide, draw_overview
from gpca.experiments.method.shown_sample import Stages
from gpca.recovery.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from tests.figures import assert_words_are_large_enough_and_inside, words_of

TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}
THRESHOLDS = {"uncertain": None, "queued_share": 0.05, "dominant": 0.4, "improvement": 0.3}


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, same_bytes):
    def draw():
        return draw_overview(*stage_files, "Solids (procedural stand-in)", "DGCNN", TREATMENTS, THRESHOLDS)

    same_bytes(draw)
    written = words_of(draw())
    stages = Stages.load(*stage_files)
    row = stages.choose("pose", stage_files[0])
    sample, of = stages.predictions.iloc[row], stages.registrations
    assert f"{sample['score_pose']:.2f}±0.12" in written
    assert f"{sample['score_noise']:.2f}±0.10" in written
    assert f"{sample['score_overlap']:.2f}±0.05" in written
    assert stages.u_S[row] > stages.u_clean
    assert "nats (clean: < 1.0)" in stages.words(row, "icp")
    assert f"aligned: {stages.words(row, 'icp')}" in written
    assert any(f"{100 * of.severity_translation[row]:.0f} % $d$" in words for words in written)
    assert f"Solids (procedural stand-in): {of.object_name[row]}" in written
    assert "Act on pose:\nReinitialize ICP" in written
    assert r"$\mathbf{h} \in \mathbb{R}^{12}$" in written


def test_the_branch_follows_from_what_gpca_knows_and_not_from_the_true_error(stage_files, monkeypatch):
    monkeypatch.setattr(Stages, "error", lambda self, row: 0.012)  # It did not fail, which GP-CA cannot know.
    stages = Stages.load(*stage_files)
    row = stages.choose("pose", stage_files[0])
    policy = RecoveryPolicy(Thresholds(uncertain=1.0, dominant=0.4, improvement=0.3), TREATMENTS)
    assert decide(stages, row, policy).action == "reinitialize"
    assert decide(stages, row, RecoveryPolicy(Thresholds(uncertain=0.0), TREATMENTS)).action == QUEUE
    assert decide(replace(stages, u_clean=np.inf), row, policy).action == NOTHING


def test_the_threshold_of_bald_is_drawn_and_named(stage_files):
    figure = draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS, THRESHOLDS | {"uncertain": 0.25})
    assert "BALD: ask above 0.25 nats" in words_of(figure)
    lines = [line.get_xdata()[0] for panel in figure.axes for line in panel.get_lines()]
    assert {0.25, 0.4} <= set(lines)


def test_no_letter_is_smaller_than_7_pt_and_none_leaves_the_figure(stage_files):
    figure = draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS, THRESHOLDS)
    assert len(words_of(figure)) > 15
    assert_words_are_large_enough_and_inside(figure)


def test_a_concept_without_treatment_is_refused(stage_files):
    with pytest.raises(InputError, match=r"recovery\.treatments: has no action for 'pose'"):
        draw_overview(*stage_files, "Solids", "DGCNN", {"noise": "denoise"}, THRESHOLDS)
