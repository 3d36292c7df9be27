"""The steps of shifted truths, from the drawing of samples to the table."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS
from gpca.experiments import shifts as experiment
from gpca.jobs.job import Job
from gpca.reenactment.dataset import Reenactments
from gpca.steps import diagnosis
from gpca.steps import shifts as step
from gpca.steps.diagnosis import training_rows
from tests.conftest import FEW_CAUSES
from tests.experiments.runs import run_with

EXPLAINERS = {"most_frequent": None, "residuals": None, "reenact": None}
NAMES = ("causes", "descriptors", "reenactments")
TRUTHS = {
    "scaled": {"title": "Scaled", "causes": {"form": {"scale": 0.02}}},
    "planes": {"title": "Planes", "method": "point_to_plane"},
}
RUN = run_with(
    sources={"four": {"title": "Four", "kind": "procedural"}},
    cause_shifts={"explainers": list(EXPLAINERS), "truths": TRUTHS, "sources": ["four"]},
)


@pytest.fixture(scope="module")
def folder(four, causes, tmp_path_factory):
    """Files of a run with two shifts: what is learned, what is asked about, and the answers."""
    folder = tmp_path_factory.mktemp("shifts")
    four.save(folder / "four.npz", "four")
    causes.save(folder / "standard/causes/four/seed100.npz")
    reads = {"descriptors": {"starts": 1, "restarts": 2, "icp_points": 64}, "reenactment": {"hypotheses": 2}}
    for shift in ("standard", *TRUTHS):
        files = {name: [folder / shift / name / "four/seed100.npz"] for name in NAMES}
        settings = {
            "causes": FEW_CAUSES | {"points": list(FEW_CAUSES["points"])},
            "drawn": {"test": 6, "candidates": 6},
            "shift": TRUTHS.get(shift, {"title": "Standard"}),
            **reads,
        }
        if shift in TRUTHS:
            step.draw(Job(settings=settings, objects=[folder / "four.npz"], causes=files["causes"]))
        step.observe(Job(settings=settings, **files))
    learned = {name: [folder / "standard" / name / "four/seed100.npz"] for name in NAMES}
    asked = {f"shifted_{name}": [folder / shift / name / "four/seed100.npz" for shift in TRUTHS] for name in NAMES}
    step.diagnose(
        Job(
            **learned,
            **asked,
            **{"encoders": [], "embeddings": [], "source": "cause_shifts", "seed": 100, "sources_asked": ["four"]},
            settings={"explainers": EXPLAINERS, **reads, "encoder": {}},
            predictions=folder / "diagnoses/seed100.csv",
        )
    )
    return folder


def truth_files(folder):
    return [[folder / shift / "causes/four/seed100.npz" for shift in names] for names in (["standard"], TRUTHS)]


def test_every_explainer_answers_for_the_test_samples_of_every_shift(folder):
    rows = read_predictions(folder / "diagnoses/seed100.csv", labels=step.LABELS)
    assert set(rows["explainer"]) == set(EXPLAINERS)
    for shift in ("standard", *TRUTHS):
        causes = Causes.load(folder / shift / "causes/four/seed100.npz")
        tested = causes.registrations.sample[causes.rows("test")]
        answers = rows[(rows["shift"] == shift) & (rows["explainer"] == "reenact")]
        assert answers["sample"].astype(int).tolist() == tested.tolist()
        verdict = Reenactments.load(folder / shift / "reenactments/four/seed100.npz").verdict[causes.rows("test")]
        assert answers["score_nominal"].to_numpy() == pytest.approx(verdict[:, 0], abs=1e-5)


def test_nothing_is_learned_from_families_that_are_asked_about(folder, causes):
    every = step.labeled(causes).subset(causes.rows("test"))
    learned = {"causes": [folder / "standard/causes/four/seed100.npz"]}
    learned |= {"descriptors": [folder / "standard/descriptors/four/seed100.npz"]}
    job = Job(source="x", seed=100, settings={"encoder": {}, "descriptors": {}, "reenactment": {}})
    families = {}
    for apart in (False, True):
        # Even where a training family is asked about as well.
        both = causes.registrations
        world = step.World(job, learned, step.labeled(causes), 13, lambda reads: step.labeled(causes), apart=apart)
        ((training, _),) = world.prepare("residuals")
        families[apart] = set(training.cluster)
    assert families[False] == set(both.cluster[training_rows(step.labeled(causes), "")]) and not families[True]
    assert not families[False] & set(every.cluster)


def test_an_encoder_whose_families_are_all_asked_about_is_not_even_loaded(folder, causes, monkeypatch):
    every = step.labeled(causes)
    elsewhere = replace(every, cluster=np.char.add("other ", every.cluster))
    monkeypatch.setattr(diagnosis, "with_what_it_reads", lambda _, reads, path: {"a": every, "b": elsewhere}[path])
    monkeypatch.setattr("gpca.encoders.training.load_model", lambda weights, *_: {2.0: 2.0}[weights])  # no other
    monkeypatch.setattr("gpca.encoders.training.embed", lambda model, *_: (np.full((len(every), 1), model), None))

    def prepared(*names):
        files = {"causes": [folder / "standard/causes/four/seed100.npz"] * len(names), "embeddings": list(names)}
        files["encoders"] = [1.0 + place for place in range(len(names))]
        job = Job(source="x", seed=100, settings={"encoder": {}, "descriptors": {}, "reenactment": {}})
        return step.World(job, files, every, 13, lambda reads: every, apart=True).prepare("gpca")

    ((training, asked),) = prepared("a", "b")
    assert set(training.cluster) <= set(elsewhere.cluster) and (asked.attached["embedding"] == 2).all()
    with pytest.raises(InputError, match=r"gpca.*nothing to learn from"):
        prepared("a")


def test_measures_are_of_each_shift_and_of_their_mean(folder):
    rows = experiment.collect(RUN, [folder / "diagnoses/seed100.csv"], *truth_files(folder))
    assert list(rows.columns) == [*KEYS, *AGAINST, *NUMBERS]
    chosen = rows[(rows["metric"] == "false_alarm_rate") & (rows["against"] == "")]
    of = chosen.set_index(["method", "concept"])["value"]
    for name in EXPLAINERS:
        assert of[name, "mean"] == pytest.approx((of[name, "scaled"] + of[name, "planes"]) / 2)
        assert of[name, "drop"] == pytest.approx(of[name, "mean"] - of[name, "standard"])
    leads = rows[rows["against"] == "trained"]
    assert set(leads["other"]) == {"residuals"} and "ceiling" not in set(leads["method"])


def test_both_tables_show_all_explainers_and_shifts(folder, monkeypatch):
    rows = experiment.collect(RUN, [folder / "diagnoses/seed100.csv"], *truth_files(folder))
    whole, by_shift = experiment.table9_shift(RUN, rows).markdown(), experiment.table9_shifts(RUN, rows).markdown()
    assert "| Re-enactment (untrained) | its starts and limits, and every registration method |" in whole
    assert "The aim is " in whole.partition("As learned:")[0]
    assert "| nothing |" in whole and "| its samples |" in whole
    titles = ("As learned, model moved", "Scaled", "Planes", "Mean over shifts")
    assert all(f"| {title} |" in by_shift for title in titles)
    shown = experiment.table9_shifts(RUN, rows)
    assert list(shown.columns) == ["samples", "lead", "reenact", "residuals", "most_frequent"]
    tree = rows[rows["method"] == "residuals"].replace({"method": {"residuals": "tree_trivial"}})
    better = pd.concat([rows, tree.assign(value=tree["value"] + 1)])
    assert list(experiment.table9_shifts(RUN, better).columns)[3:] == ["residuals", "tree_trivial", "most_frequent"]
    monkeypatch.setattr(experiment, "PRODUCT", "scaled")  # what a user does comes first
    whole, by_shift = experiment.table9_shift(RUN, rows), experiment.table9_shifts(RUN, rows)
    assert list(whole.columns)[:2] == ["scaled", "standard"]
    assert by_shift.rows[0][0][1] == "Scaled, as in `gpca explain`"


TITLES = {"reenact": "Re-enactment", "residuals": "Residuals"}


def test_an_aim_is_reached_by_the_mean_its_interval_and_every_shift():
    def sentence(mean, low, scaled):
        keys = ("causes", "pooled", "reenact", "balanced_accuracy")
        rows = [(*keys, "mean", "trained", "residuals", 1, 2, 9, mean, low, 0.2)]
        rows.append((*keys, "scaled", "trained", "residuals", 1, 2, 9, scaled, -0.1, 0.2))
        return experiment.reached(pd.DataFrame(rows, columns=[*KEYS, *AGAINST, *NUMBERS]), {"scaled": "S"}, TITLES)

    assert sentence(0.06, 0.01, -0.02).startswith("The aim is reached")
    for missed in ((0.04, 0.01, 0.1), (0.06, -0.01, 0.1), (0.06, 0.01, -0.04)):
        assert sentence(*missed).startswith("The aim is not reached")
    assert sentence(0.06, 0.01, -0.04).endswith(" by 6.0 (1.0 to 20.0); below -3 under: S.")
    assert sentence(0.06, -0.01, 0.1).startswith("The aim is not reached, as the interval contains 0")
    assert "Residuals leads Re-enactment" in sentence(-0.04, -0.1, 0.1)
