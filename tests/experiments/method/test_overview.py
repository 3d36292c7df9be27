import pytest

from gpca.errors import InputError
from gpca.experiments.method.overview import draw_overview
from gpca.experiments.method.shown_sample import Stages

TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, tmp_path, written):
    for name in ("a", "b"):
        paths = (tmp_path / f"{name}.pdf", tmp_path / f"{name}.png")
        draw_overview(*stage_files, "Solids (procedural stand-in)", "DGCNN", TREATMENTS, *paths)
    for suffix in ("pdf", "png"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
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


def test_nothing_is_done_about_what_did_not_fail(stage_files, tmp_path, written, monkeypatch):
    monkeypatch.setattr(Stages, "error", lambda self, row: 0.012)
    draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS, tmp_path / "a.pdf", tmp_path / "a.png")
    assert "No action on\npose: it did\nnot fail" in written
    assert not [words for words in written if words.startswith("Act on")]


def test_no_letter_is_smaller_than_7_pt_and_none_leaves_the_figure(stage_files, tmp_path, monkeypatch):
    from matplotlib.text import Text

    from gpca.reporting.figures import style

    figures = []
    monkeypatch.setattr(style, "save_png", lambda figure, path: figures.append(figure))
    draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS, tmp_path / "a.pdf", tmp_path / "a.png")
    (figure,) = figures
    texts = [text for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    assert len(texts) > 15
    for text in texts:
        assert text.get_fontsize() >= 7, text.get_text()
        box, page = text.get_window_extent(), figure.bbox
        assert box.x0 >= -1 and box.x1 <= page.width + 1 and box.y0 >= -1 and box.y1 <= page.height + 1, text.get_text()


def test_a_concept_without_treatment_is_refused(stage_files, tmp_path):
    with pytest.raises(InputError, match=r"recovery\.treatments: has no action for 'pose'"):
        draw_overview(*stage_files, "Solids", "DGCNN", {"noise": "denoise"}, tmp_path / "a.pdf", tmp_path / "a.png")
    assert not (tmp_path / "a.pdf").exists()
