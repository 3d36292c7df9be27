"""Figure 4."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.active_learning.acquisition import EXPANSION
from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.rounds import initial_gpc, make_task, rounds
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.declarations.plan import Run
from gpca.experiments.pipeline import fig4_pipeline, first_round
from gpca.experiments.registration_stages import Staged, severity_text
from tests.figures import assert_words_are_large_enough_and_inside, words_of

from .runs import SOLIDS

BATCH = 3
LEARNING = {"initial": 8, "labels": 6, "batch": BATCH, "gpc": {"inducing": 8, "iterations": 20, "draws": 50}}


def pipeline(stage_files, curve_files, encoder="dgcnn"):
    *files, limits = stage_files
    embedding = {"encoder": encoder, "reduction": "none"}
    run = Run(SOLIDS | {"causes": {"limits": limits}, "embedding": embedding, "active_learning": LEARNING})
    return fig4_pipeline(run, *files, curve_files)


@pytest.fixture(scope="module")
def curve_files(tmp_path_factory):
    """Of two strategies, two seeds each."""
    folder, paths = tmp_path_factory.mktemp("curves"), []
    for strategy, gain in (("bald_kmeans", 0.02), ("random", 0.01), ("entropy", 0.05)):
        for seed in (0, 1):
            path = folder / "solids" / strategy / f"seed{seed}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            steps = [(n, n // 2, 0.5 + gain * n + seed / 100, 0.4, 5) for n in (0, 3, 6)]
            rows = [dict(zip(POOL_COLUMNS[2:], step, strict=True)) for step in steps]
            higher = [row | {"accuracy": row["accuracy"] + 0.3} for row in rows]
            curves = {("pretrained", "pose"): higher, ("pretrained", "overlap"): rows, ("unseen", "overlap"): rows[:1]}
            write_curves(path, curves, POOL_COLUMNS)
            paths.append(path)
    return paths


@pytest.fixture(scope="module")
def asked(stage_files):
    return first_round(Staged.load(*stage_files), "overlap", ActiveLearningSettings.from_dict(LEARNING), "solids", 0)


def test_the_round_is_the_first_of_the_run_and_asks_about_uncertain_and_different_samples(asked, stage_files):
    stages, settings = Staged.load(*stage_files), ActiveLearningSettings.from_dict(LEARNING)
    of = stages.registrations
    assert sorted([*asked.rows_N, *asked.labeled]) == of.rows("train").tolist()
    assert set(of.concept[asked.labeled]) == {"noise", "pose"}
    task = make_task(replace(of, attached={"embedding": stages.h_S_d}), "overlap", settings, "solids", 0)
    gpc = initial_gpc(task, settings, "solids", 0, "pretrained")
    steps = rounds(task.project(gpc), gpc, "bald_kmeans", settings, "solids", 0, "pretrained")
    next(steps)
    assert next(steps)[1] == asked.chosen.tolist()
    assert set(asked.candidates) == set(np.argsort(-asked.bald_N, kind="stable")[: BATCH * EXPANSION])
    assert len(set(asked.chosen)) == BATCH and set(asked.chosen) <= set(asked.candidates)


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, curve_files, asked, same_bytes):
    def draw():
        return pipeline(stage_files, curve_files, "pointnet")

    same_bytes(draw)
    written = words_of(draw())
    stages = Staged.load(*stage_files)
    row = stages.choose("overlap", stage_files[0], "pose", "noise")
    sample, of = stages.predictions.iloc[row], stages.registrations
    assert f"{sample['score_overlap']:.2f}±0.05" in written
    assert f"{sample['score_pose']:.2f}±0.12" in written
    assert "initial pose $T_0$:\n" + severity_text(of, row, sample["concept_true"]) in written
    assert any(words.endswith(stages.words(row, "icp")) for words in written)
    low, high = asked.bald_N.min(), asked.bald_N.max()
    assert f"{low:.2f} to {high:.2f} nats; $B K$ = 12\nringed; ×: labeled before" in written
    assert "28 training samples" in written
    assert "Retrain: overlap is new" in written
    assert "PointNet\n$f_\\theta$" in written


def test_letters_are_large_enough_inside_and_apart(stage_files, curve_files):
    figure = pipeline(stage_files, curve_files)
    assert_words_are_large_enough_and_inside(figure)
    on_canvas = figure.axes[0].texts
    boxes = {text.get_text(): text.get_window_extent().shrunk(0.98, 0.8) for text in on_canvas if text.get_text()}
    for words, box in boxes.items():
        assert not [other for other, its in boxes.items() if other != words and box.overlaps(its)], words
    lines = {line.get_label(): line for axes in figure.axes for line in axes.get_lines()}
    for label, last in (("BALD + $k$-means", 62.5), ("random", 56.5)):
        np.testing.assert_allclose(lines[label].get_ydata()[-1], last)
    assert "entropy" not in lines
