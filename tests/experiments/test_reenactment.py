"""The figure of a re-enactment."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import CauseSettings
from gpca.causes.truth import FAILED, shapley_values
from gpca.errors import InputError
from gpca.experiments.cause_figures import reenactment, usual_failure
from gpca.objects.canonical import write_objects
from gpca.objects.procedural import surfaces
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from tests.conftest import FEW_CAUSES, FOUR
from tests.experiments.runs import run_with
from tests.figures import assert_words_are_large_enough_and_inside, words_of

TRUTH, SETTINGS = CauseSettings(**FEW_CAUSES), ReenactmentSettings(hypotheses=3)


@pytest.fixture(scope="module")
def enacted(causes):
    return reenact_all(causes, "four", 100, SETTINGS, TRUTH)[0]


@pytest.fixture(scope="module")
def shown_files(causes, enacted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    paths = [folder / "objects.npz", *(folder / name / "four/seed100.npz" for name in ("causes", "reenactments"))]
    write_objects((surface for surface in surfaces("ycb") if surface.name in FOUR), "four", paths[0], n_points=6000)
    causes.save(paths[1])
    enacted.save(paths[2])
    return paths


def draw(paths):
    diagnosis = {"reenactment": {"hypotheses": SETTINGS.hypotheses}}
    sources = {"four": {"title": "Four", "kind": "procedural"}}
    run = run_with(sources=sources, figures={"source": "four"}, causes=FEW_CAUSES, diagnosis=diagnosis)
    return reenactment(run, *paths)


def test_the_sample_failed_by_several_causes_and_has_several_hypotheses_where_one_has(causes, enacted):
    row = usual_failure(causes, "causes.npz", enacted.weight[:, 1] > 0)
    tested = causes.rows("test")
    failed = tested[causes.truth.state[tested] == FAILED]
    several = failed[causes.truth.causes[failed].sum(axis=1) > 1]
    assert row in several
    doubtful = several[enacted.weight[several, 1] > 0]
    assert row in doubtful if len(doubtful) else True
    margins = causes.truth.margin[doubtful if len(doubtful) else several]
    assert (margins >= causes.truth.margin[row]).sum() == -(-len(margins) // 2) or len(margins) % 2 == 0
    certain = replace(enacted, weight=np.eye(3)[np.zeros(len(causes), int)])
    assert usual_failure(causes, "causes.npz", certain.weight[:, 1] > 0) in several
    train = causes.rows("train")
    with pytest.raises(InputError, match="has no failed test sample"):
        usual_failure(causes.subset(train), "causes.npz", enacted.weight[train, 1] > 0)


def test_hypotheses_clouds_and_eight_errors_are_shown_with_their_words(causes, enacted, shown_files):
    figure = draw(shown_files)
    assert_words_are_large_enough_and_inside(figure)
    words, row = words_of(figure), usual_failure(causes, shown_files[1], enacted.weight[:, 1] > 0)
    weights = enacted.weight[row][enacted.weight[row] > 0]
    strip = {"after ICP", f"likeliest pose: {100 * weights[0]:.0f} %", "there, without noise", "there, completed"}
    assert strip | {"none", "all three", "measured"} <= set(words)
    phi_3 = shapley_values((weights[:, None] * enacted.error[row][: len(weights)]).sum(axis=0)[None])[0]
    named, true = CONCEPTS[int(np.argmax(phi_3))], causes.truth.dominant[row]
    verdict = f"It names {named}, as measured" if named == true else f"It names {named}; measured is {true}"
    assert any(verdict in each for each in words)
    [bars] = [panel for panel in figure.findobj(lambda each: hasattr(each, "barh")) if len(panel.patches) == 8]
    assert sorted(bar.get_width() for bar in bars.patches) == pytest.approx(sorted(100 * causes.truth.error[row]))
    assert len(bars.collections) == len(weights)


def test_a_file_of_other_settings_is_refused(causes, enacted, shown_files, tmp_path):
    path = tmp_path / "reenactments/four/seed100.npz"
    replace(enacted, error=enacted.error + 0.01).save(path)
    assert Reenactments.load(path, causes.registrations).error.shape == enacted.error.shape
    with pytest.raises(InputError, match="has other errors of sample"):
        draw((*shown_files[:2], path))
