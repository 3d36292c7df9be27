import pytest

from gpca.errors import InputError
from gpca.experiments.method.overview import draw_overview
from gpca.experiments.method.shown_sample import Stages
from tests.figures import assert_words_are_large_enough_and_inside, words_of

TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, same_bytes):
    def draw():
        return draw_overview(*stage_files, "Solids (procedural stand-in)", "DGCNN", TREATMENTS)

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


def test_nothing_is_done_about_what_did_not_fail(stage_files, monkeypatch):
    monkeypatch.setattr(Stages, "error", lambda self, row: 0.012)
    written = words_of(draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS))
    assert "No action on\npose: it did\nnot fail" in written
    assert not [words for words in written if words.startswith("Act on")]


def test_no_letter_is_smaller_than_7_pt_and_none_leaves_the_figure(stage_files):
    figure = draw_overview(*stage_files, "Solids", "DGCNN", TREATMENTS)
    assert len(words_of(figure)) > 15
    assert_words_are_large_enough_and_inside(figure)


def test_a_concept_without_treatment_is_refused(stage_files):
    with pytest.raises(InputError, match=r"recovery\.treatments: has no action for 'pose'"):
        draw_overview(*stage_files, "Solids", "DGCNN", {"noise": "denoise"})
