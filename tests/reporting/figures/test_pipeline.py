import numpy as np
import pytest
from matplotlib.text import Text

from gpca.active_learning.acquisition import EXPANSION
from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.errors import InputError
from gpca.reporting.figures import style
from gpca.reporting.figures.label_round import next_round
from gpca.reporting.figures.pipeline import draw_pipeline
from gpca.reporting.figures.shown_sample import Stages

BATCH = 3


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
            write_curves(path, {("pretrained", "pose"): rows, ("unseen", "pose"): rows[:1]}, POOL_COLUMNS)
            paths.append(path)
    return paths


def test_the_next_round_asks_about_the_most_uncertain_and_about_different_ones(stage_files):
    stages = Stages.load(*stage_files)
    asked = next_round(stages, BATCH)
    assert (stages.registrations.split[asked.rows_N] == "test").all()
    bald_N = stages.predictions["bald"].to_numpy()[asked.rows_N]
    assert set(asked.candidates) == set(np.argsort(-bald_N)[: BATCH * EXPANSION])
    assert len(set(asked.chosen)) == BATCH and set(asked.chosen) <= set(asked.candidates)
    again = next_round(stages, BATCH)
    np.testing.assert_array_equal(asked.chosen, again.chosen)
    np.testing.assert_array_equal(asked.map_S_2, again.map_S_2)


def test_the_map_separates_what_the_embedding_separates(stage_files):
    stages = Stages.load(*stage_files)
    map_S_2, concept_S = next_round(stages, BATCH).map_S_2, stages.registrations.concept
    centres = [map_S_2[concept_S == concept].mean(axis=0) for concept in ("noise", "pose", "overlap")]
    for i in range(3):
        assert np.linalg.norm(centres[i] - centres[i - 1]) > 1


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, curve_files, tmp_path, written):
    for name in ("a", "b"):
        paths = (tmp_path / f"{name}.pdf", tmp_path / f"{name}.png")
        draw_pipeline(*stage_files, curve_files, "Solids (procedural stand-in)", "PointNet", BATCH, *paths)
    for suffix in ("pdf", "png"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    stages = Stages.load(*stage_files)
    row = stages.choose("overlap", stage_files[0])
    sample, of = stages.predictions.iloc[row], stages.registrations
    assert f"{sample['score_overlap']:.2f}±0.05" in written
    assert f"{sample['score_pose']:.2f}±0.12" in written
    assert f"initial pose $T_0$: {100 * of.severity_crop[row]:.0f} % cut off" in written
    assert any(words.endswith(stages.words(row, "icp")) for words in written)
    bald = stages.predictions.loc[stages.predictions["split"] == "test", "bald"]
    assert f"{bald.min():.2f} to {bald.max():.2f} nats;\n$B K$ = 12 ringed" in written
    assert "18 test samples" in written
    assert "PointNet\n$f_\\theta$" in written


def test_letters_are_large_enough_inside_and_apart(stage_files, curve_files, tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(style, "save_png", lambda figure, path: figures.append(figure))
    draw_pipeline(*stage_files, curve_files, "Solids", "DGCNN", BATCH, tmp_path / "a.pdf", tmp_path / "a.png")
    (figure,) = figures
    texts = [text for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    for text in texts:
        assert text.get_fontsize() >= 7, text.get_text()
        box, page = text.get_window_extent(), figure.bbox
        assert box.x0 >= -1 and box.x1 <= page.width + 1 and box.y0 >= -1 and box.y1 <= page.height + 1, text.get_text()
    on_canvas = figure.axes[0].texts
    boxes = {text.get_text(): text.get_window_extent().shrunk(0.98, 0.8) for text in on_canvas if text.get_text()}
    for words, box in boxes.items():
        assert not [other for other, its in boxes.items() if other != words and box.overlaps(its)], words
    lines = {line.get_label(): line for axes in figure.axes for line in axes.get_lines()}
    for label, last in (("BALD + $k$-means", 62.5), ("random", 56.5)):
        np.testing.assert_allclose(lines[label].get_ydata()[-1], last)
    assert "entropy" not in lines


def test_curves_of_other_strategies_alone_are_refused(stage_files, curve_files, tmp_path):
    others = [path for path in curve_files if "entropy" in str(path)]
    with pytest.raises(InputError, match=r"active learning: holds no curve of bald_kmeans or random; run"):
        draw_pipeline(*stage_files, others, "Solids", "DGCNN", BATCH, tmp_path / "a.pdf", tmp_path / "a.png")
    assert not (tmp_path / "a.pdf").exists()
