"""Re-enactments: the figure of one, measures of oracles and their differences from the estimate."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.attribution.predictions import write_predictions
from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.judged import CEILING
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import FAILED, shapley_values
from gpca.classifier.scores import Attribution
from gpca.config.check import check
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED
from gpca.experiments.cause_figures import draw_reenactment, usual_failure
from gpca.experiments.reenactment import EXPERIMENT, MEASURED, collect_oracles, in_words, table9_oracle
from gpca.objects.canonical import write_objects
from gpca.objects.procedural import surfaces
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.settings import EVERYTHING, KNOWN, NOTHING, ReenactmentSettings
from tests.config.configs import changed
from tests.conftest import FEW_CAUSES, FOUR
from tests.experiments.runs import run_with
from tests.figures import assert_words_are_large_enough_and_inside, words_of

TRUTH, SETTINGS = CauseSettings(**FEW_CAUSES), ReenactmentSettings(hypotheses=3)
SOURCES = {"four": {"title": "Four", "stand_in": True}, "more": {"title": "More", "stand_in": False}}
RUN = run_with(sources=SOURCES)
CONFIG = {"seeds": [3, 4, 5], "sources": {"a": {}, "b": {}}, "oracles": {"sources": ["b"], "seeds": 2}}


def test_oracles_are_asked_about_the_named_sources_and_the_first_seeds():
    names = EXPERIMENT.names(CONFIG, {})
    assert (names["oracle_source"], names["oracle_seed"]) == (["b"], [3, 4])


def test_a_source_that_there_is_not_is_refused():
    with pytest.raises(InputError, match=r"oracles\.sources"):
        check(changed("oracles.sources", ["c"]))


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
    return draw_reenactment(*paths, TRUTH, SETTINGS, "Four (procedural stand-in)")


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


def test_the_figure_is_the_same_bytes_each_time(shown_files, same_bytes):
    same_bytes(lambda: draw(shown_files))


def test_a_file_of_other_settings_is_refused(causes, enacted, shown_files, tmp_path):
    path = tmp_path / "reenactments/four/seed100.npz"
    replace(enacted, error=enacted.error + 0.01).save(path)
    assert Reenactments.load(path, causes.registrations).error.shape == enacted.error.shape
    with pytest.raises(InputError, match="has other errors of sample"):
        draw((*shown_files[:2], path))


@pytest.fixture(scope="module")
def files(causes, tmp_path_factory):
    """Who knows nothing always says pose, who knows everything is always right; two sources."""
    folder = tmp_path_factory.mktemp("run")
    label = labels_of(causes.truth)
    right = np.array([[name == each for name in LABELS] for each in label], float) + 0.01
    says = {NOTHING: np.tile([0.1, 0.1, 0.7, 0.1], (len(label), 1)), EVERYTHING: right}
    predictions, truths = [], []
    for source in SOURCES:
        truths.append(folder / "causes" / source / "seed100.npz")
        own = replace(causes, registrations=replace(causes.registrations, axes=(source, 100)))
        own.save(truths[-1])
        for name, scores in says.items():
            predictions.append(folder / "oracles" / source / name / "seed100.csv")
            attribution = Attribution.of_scores(LABELS, scores / scores.sum(axis=1, keepdims=True), seconds=0.0)
            write_predictions(predictions[-1], own.registrations, attribution)
    return predictions, truths


@pytest.fixture(scope="module")
def oracles(files):
    return collect_oracles(RUN, *files)


def test_differences_are_those_from_the_estimate_on_the_same_draws(oracles):
    rows = oracles.set_index(["source", "method", "against", "metric"]).sort_index()
    assert set(oracles["source"]) == {*SOURCES, POOLED} and set(oracles["method"]) == {NOTHING, EVERYTHING, CEILING}
    assert list(oracles["metric"].unique()) == list(MEASURED)
    for source in (*SOURCES, POOLED):
        none, every = rows.loc[(source, NOTHING, "")], rows.loc[(source, EVERYTHING, "")]
        gain = rows.loc[(source, EVERYTHING, "estimate")]
        assert every.loc["balanced_accuracy", "value"] == 1 and every.loc["auroc_failed", "value"] == 1
        assert (source, NOTHING, "estimate") not in rows.index.droplevel("metric")
        for metric in MEASURED:
            apart = every.loc[metric, "value"] - none.loc[metric, "value"]
            assert gain.loc[metric, "value"] == pytest.approx(apart)
        assert gain.loc["regret", "value"] <= 0 < gain.loc["balanced_accuracy", "value"]
        assert np.isfinite(rows.loc[(source, CEILING, "estimate")]["value"]).all()


def test_the_table_has_a_row_for_all_that_is_known_and_the_ceiling_last(oracles):
    table = table9_oracle(RUN, oracles)
    text = table.markdown()
    assert "stand-in" in table.caption
    assert text.index("| All together | nothing: the estimate |") < text.index("| All together | all three |")
    assert text.index("| All together | all three |") < text.index("| All together | Truth from other starts")
    assert text.index("All together") < text.index("Four (procedural stand-in)")
    [record] = [r for r in table.records() if r[:3] == (POOLED, EVERYTHING, "balanced_accuracy")]
    assert record[3] == pytest.approx(100)
    assert (0, "balanced_accuracy_gain") not in table.cells and (1, "balanced_accuracy_gain") in table.cells
    with pytest.raises(InputError, match="has nothing to show"):
        table9_oracle(RUN, oracles[oracles["method"] == "other"])


def test_every_set_of_known_causes_has_its_words():
    words = {name: in_words(name) for name in KNOWN}
    assert len(set(words.values())) == len(KNOWN)
    assert words["noise_pose"] == "true pose + points without noise"
