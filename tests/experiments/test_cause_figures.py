import numpy as np
import pytest

from gpca.causes.candidate import replay
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, FAILED, SUBSETS
from gpca.errors import InputError
from gpca.experiments import cause_figures
from gpca.objects.canonical import write_objects
from gpca.objects.procedural import surfaces
from gpca.pairs.perturbation import CONCEPTS
from tests.conftest import FEW_CAUSES, FOUR
from tests.experiments.runs import run_with
from tests.figures import words_of
from tests.judged import write_run


def test_a_sample_is_drawn_again_where_it_lay(four, causes):
    row = cause_figures.usual_failure(causes, "causes.npz", cause_figures.is_clear(causes))
    model, observed_8 = replay(four, causes, row, "four", 100, CauseSettings(**FEW_CAUSES))
    assert observed_8[ALL] == pytest.approx(causes.registrations.cloud(row), abs=1e-5)
    assert np.array_equal(model.astype(np.float32), causes.registrations.target(row))
    with pytest.raises(InputError, match="is not reproduced by these settings"):
        replay(four, causes, row, "four", 101, CauseSettings(**FEW_CAUSES))


def test_the_sample_shown_failed_by_several_causes_of_which_one_is_as_clear_as_usual(causes):
    row = cause_figures.usual_failure(causes, "causes.npz", cause_figures.is_clear(causes))
    failed = causes.rows("test")[causes.truth.state[causes.rows("test")] == FAILED]
    several = failed[causes.truth.causes[failed].sum(axis=1) > 1]
    phi = np.maximum(causes.truth.phi, 0)
    share = phi.max(axis=1) / phi.sum(axis=1)
    clear = several[share[several] >= cause_figures.CLEAR]
    assert row in (clear if len(clear) else several)
    margins = causes.truth.margin[clear if len(clear) else several]
    assert causes.truth.margin[row] in margins[margins >= np.median(margins)]
    assert (margins >= causes.truth.margin[row]).mean() >= 0.5 or len(margins) == 1
    train = causes.rows("train")
    with pytest.raises(InputError, match="has no failed test sample"):
        cause_figures.usual_failure(causes.subset(train), "causes.npz", cause_figures.is_clear(causes)[train])


def test_what_was_measured_stands_apart_from_the_scores_and_the_largest_of_a_row_is_bold():
    import matplotlib.pyplot as plt

    figure, panel = plt.subplots()
    numbers = np.array([[0.0, 0.5, 0.3, 0.2], [0.1, 0.2, 0.9, 0.8], [0.7, 0.1, 0.1, 0.1]])
    scored = zip(numbers, ("", "wrong", "tie"), strict=True)
    answers = dict(zip((cause_figures.TRUTH, "Multi-label", "Right"), scored, strict=True))
    cause_figures._draw_scores(panel, answers)
    assert panel.get_yticks().tolist() == [0, 1 + cause_figures.GAP, 2 + cause_figures.GAP]
    bold = {text.get_text() for text in panel.texts if text.get_fontweight() == "bold"}
    assert bold == {"0.50", "0.90", "0.70", "", "tie"}
    plt.close(figure)


def test_the_bars_of_a_waterfall_begin_where_others_end_and_add_up(causes):
    import matplotlib.pyplot as plt

    figure, panel = plt.subplots()
    row = cause_figures.usual_failure(causes, "causes.npz", cause_figures.is_clear(causes))
    error_8, phi_3 = causes.truth.error[row], causes.truth.phi[row]
    cause_figures._draw_waterfall(panel, error_8[SUBSETS.index(())], phi_3)
    first, *added, last = panel.patches
    ends = [first.get_width(), *(bar.get_x() + bar.get_width() for bar in added)]
    assert [bar.get_x() for bar in added] == pytest.approx(ends[:-1])
    assert [bar.get_width() for bar in added] == pytest.approx(sorted(100 * phi_3))
    assert last.get_width() == pytest.approx(ends[-1]) == pytest.approx(100 * error_8[ALL])
    plt.close(figure)


@pytest.fixture
def run(monkeypatch):
    titles = {"right": "Right", "always_pose": "Always pose"}
    monkeypatch.setattr("gpca.experiments.cause_figures.cause_titles", lambda config: titles)
    source = {"four": {"title": "Four", "kind": "procedural", "stand_in": False}}
    return run_with(sources=source, figures={"source": "four"}, causes=FEW_CAUSES)


def objects_in(folder):
    objects = folder / "four.npz"
    write_objects((surface for surface in surfaces("ycb") if surface.name in FOUR), "four", objects, n_points=6000)
    return objects


def test_a_failure_of_each_cause_is_shown_with_who_names_it(causes, run, tmp_path):
    predictions, [truth] = write_run(tmp_path, causes)
    figure = cause_figures.failures(run, [objects_in(tmp_path)], [truth], predictions)
    failed = (causes.registrations.split == "test") & (causes.truth.state == FAILED)
    words = {text for text in words_of(figure) if " off" in text or "no failure" in text}
    assert len(words) == len(CONCEPTS)
    for concept in CONCEPTS:
        errors = np.sort(causes.error_shown[failed & (causes.truth.dominant == concept)])
        shown = f"{concept}: {100 * errors[len(errors) // 2]:.0f} % off" if len(errors) else f"no failure by {concept}"
        [caption] = [each for each in words if each.startswith(shown)]
        assert not len(errors) or "right: Right" in caption


def test_the_example_names_its_dataset_and_who_is_right(causes, run, tmp_path):
    predictions, [truth] = write_run(tmp_path, causes)
    figure = cause_figures.causes_example(run, objects_in(tmp_path), truth, predictions)
    words, row = words_of(figure), cause_figures.usual_failure(causes, truth, cause_figures.is_clear(causes))
    assert words[0].startswith(f"Four: {causes.registrations.object_name[row].partition('_')[2].replace('_', ' ')}.")
    phi_3 = np.maximum(causes.truth.phi[row], 0)
    alike = cause_figures._answers(causes, row, predictions, dict.fromkeys(("right", "always_pose"), "Same"))
    assert list(alike) == ["Same (right)", "Same (always_pose)"]
    assert {"without causes", "Right", "right", *(f"{share:.2f}" for share in phi_3 / phi_3.sum())} <= set(words)
