"""The figure of one re-enactment."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import CauseSettings
from gpca.causes.truth import FAILED
from gpca.errors import InputError
from gpca.experiments.reenactment.example import choose_sample, draw_reenactment
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from tests.conftest import FEW_CAUSES
from tests.figures import assert_words_are_large_enough_and_inside, words_of

TRUTH = FEW_CAUSES | {"points": list(FEW_CAUSES["points"]), "icp": {}}
SETTINGS = {"hypotheses": 3}


@pytest.fixture(scope="module")
def enacted(causes):
    return reenact_all(causes, "four", 100, ReenactmentSettings(**SETTINGS), CauseSettings(**FEW_CAUSES))[0]


@pytest.fixture(scope="module")
def files(causes, enacted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    paths = [folder / name / "four/seed100.npz" for name in ("causes", "reenactments")]
    causes.save(paths[0])
    enacted.save(paths[1])
    return paths


def draw(files):
    return draw_reenactment(*files, TRUTH, SETTINGS, "Four (procedural stand-in)")


def test_the_sample_failed_by_several_causes_and_has_several_hypotheses_where_one_has(causes, enacted):
    row = choose_sample(causes, enacted, "causes.npz")
    tested = causes.rows("test")
    failed = tested[causes.truth.state[tested] == FAILED]
    several = failed[causes.truth.causes[failed].sum(axis=1) > 1]
    assert row in several
    doubtful = several[enacted.weight[several, 1] > 0]
    assert row in doubtful if len(doubtful) else True
    margins = causes.truth.margin[doubtful if len(doubtful) else several]
    assert (margins >= causes.truth.margin[row]).sum() == -(-len(margins) // 2) or len(margins) % 2 == 0
    certain = replace(enacted, weight=np.eye(3)[np.zeros(len(causes), int)])
    assert choose_sample(causes, certain, "causes.npz") in several
    train = causes.rows("train")
    with pytest.raises(InputError, match="has no failed test sample"):
        choose_sample(causes.subset(train), replace(enacted, weight=enacted.weight[train]), "causes.npz")


def test_hypotheses_clouds_and_eight_errors_are_shown_with_their_words(causes, enacted, files):
    figure = draw(files)
    assert_words_are_large_enough_and_inside(figure)
    words, row = words_of(figure), choose_sample(causes, enacted, files[0])
    weights = enacted.weight[row][enacted.weight[row] > 0]
    assert {f"{k + 1}: {100 * weight:.0f} %" for k, weight in enumerate(weights)} <= set(words)
    assert {"as observed", "without noise", "completed", "both", "none", "all three", "measured"} <= set(words)
    [bars] = [panel for panel in figure.findobj(lambda each: hasattr(each, "barh")) if len(panel.patches) == 8]
    assert sorted(bar.get_width() for bar in bars.patches) == pytest.approx(sorted(100 * causes.truth.error[row]))
    assert len(bars.collections) == len(weights)


def test_the_figure_is_the_same_bytes_each_time(files, same_bytes):
    same_bytes(lambda: draw(files))


def test_a_file_of_other_settings_is_refused(causes, enacted, files, tmp_path):
    path = tmp_path / "reenactments/four/seed100.npz"
    replace(enacted, error=enacted.error + 0.01).save(path)
    assert Reenactments.load(path, causes.registrations).error.shape == enacted.error.shape
    with pytest.raises(InputError, match="has other errors of sample"):
        draw((files[0], path))
