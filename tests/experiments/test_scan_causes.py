"""Numbers, tables and the figure of the causes on scans, from made-up answers about measured samples."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import prediction_frame
from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED
from gpca.experiments import scan_causes
from gpca.experiments.scan_causes import ADDED, EVERY, NATURAL, collect, read_scan_causes
from gpca.experiments.scan_failures import (
    counts_of,
    scan_failures,
    shares_in_words,
    table18_scan_causes,
    table18_scan_counts,
)
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.cells import rows_where
from tests.experiments.runs import run_with

KNOWING, GUESSING = "pair_forest", "chance"  # explainers under whose names made-up answers stand
EXPLAINERS = (KNOWING, GUESSING, "gate_rmse")
STANDS_FOR = [5.0, 1.0, 1.0, 1.0, 2.0]  # pairs of a data set
TITLES = {"rooms": "Rooms", "things": "Things"}


def run_of(*names):
    """A run with these data sets."""
    datasets = {name: {"title": TITLES.get(name, "Other"), "kind": "virtual", "rooms": 1} for name in names or TITLES}
    return run_with(
        scans={"datasets": datasets, "strata": [0.1, 0.5, 1.0]},
        scan_causes={"explainers": {name: ["objects", "scans"] for name in EXPLAINERS}},
        data_dir=None,
    )


def answers(causes, random):
    """What an explainer says that knows the labels, one that guesses, and a gate that is mostly right."""
    label = labels_of(causes.truth)
    known = np.where(label[:, None] == np.array(LABELS), 0.85, 0.05)
    noisy = np.clip((label != NOMINAL) + random.normal(size=len(label)), 0, 1)
    gate = np.column_stack([1 - noisy, *(noisy / 3 for _ in CONCEPTS)]) + 1e-3
    guessed = random.dirichlet(np.ones(4), size=len(label))
    none = np.ones(len(label), bool)
    return {
        ("scans", KNOWING): Attribution.of_scores(LABELS, known, seconds=0.0),
        ("objects", GUESSING): Attribution.of_scores(LABELS, guessed, seconds=0.0),
        ("scans", "gate_rmse"): Attribution.of_scores(LABELS, gate, seconds=0.0, abstained_N=none),
    }


@pytest.fixture(scope="module")
def files(causes, tmp_path_factory):
    folder, random, said = tmp_path_factory.mktemp("scan_causes"), np.random.default_rng(0), []
    tested = causes.subset(causes.rows("test"))
    n = len(tested)
    scenes = np.resize(["hall", "kitchen", "attic"], n)
    tested = replace(tested, registrations=replace(tested.registrations, cluster=scenes))
    given = {"causes_files": [], "sample_files": [], "prediction_files": [folder / "seed100.csv"]}
    for name in TITLES:
        own = replace(tested, registrations=replace(tested.registrations, axes=(name, 100)))
        given["causes_files"].append(folder / name / "seed100.npz")
        given["sample_files"].append(folder / name / "seed100.csv")
        own.save(given["causes_files"][-1])
        start = np.resize(["ladder", "global", "ladder"], n)
        told = {"sample": own.registrations.sample, "cluster": own.registrations.cluster, "start": start}
        told |= {"overlap": np.resize([0.2, 0.7], n), "times": np.resize([0.0, 0.0, 0.0, 2.0], n), "missed": False}
        told |= {"stands_for": np.resize(STANDS_FOR, n), "dominant_one_sided": "pose"}
        write_csv(given["sample_files"][-1], pd.DataFrame(told))
        for (learned, explainer), attribution in answers(own, random).items():
            frame = prediction_frame(own.registrations, attribution)
            said.append(frame.assign(scans=name, learned=learned, explainer=explainer))
    write_csv(given["prediction_files"][0], pd.concat(said))
    return given


@pytest.fixture(scope="module")
def measured(files, tmp_path_factory):
    path = tmp_path_factory.mktemp("tidy") / "scan_causes.csv"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scan_causes, "FEWEST_OF_A_CAUSE", 1)
        write_csv(path, collect(run_of(), **files))
    return read_scan_causes(path)


def value(measured, **wanted):
    [row] = rows_where(measured, stratum=EVERY, **wanted).to_dict("records")
    return row


def test_who_knows_the_labels_has_no_false_alarm_and_leads_the_gate(measured):
    of = {"source": POOLED, "condition": NATURAL, "learned": "scans", "method": KNOWING}
    auroc = value(measured, metric="auroc_failed", **of)
    assert auroc["value"] == 1 and auroc["gate"] == "scans/gate_rmse"
    assert 0 == auroc["difference_low"] < auroc["difference"] <= auroc["difference_high"]  # three scenes show nothing
    assert value(measured, metric="false_alarm_rate", **of)["value"] == 0
    assert value(measured, metric="cause_accuracy", **of)["value"] == 1
    guessing = of | {"learned": "objects", "method": GUESSING}
    assert value(measured, metric="auroc_failed", **guessing)["difference"] < 0
    assert value(measured, metric="cause_accuracy", **guessing)["value"] < 0.7


def test_failures_of_a_global_methods_starts_count_as_often_as_their_pairs_stand_for(measured, causes):
    label = labels_of(causes.subset(causes.rows("test")).truth)
    number = np.arange(len(label))
    failed = (number % 3 == 1) & (number % 4 != 3) & np.isin(label, CONCEPTS)
    of = {"source": "rooms", "condition": "natural_global", "method": "failed"}
    for concept in CONCEPTS:
        shares = [value(measured, metric=f"{name}_{concept}", **of)["value"] for name in scan_causes.SHARES]
        weights = [np.ones(len(label)), np.resize(STANDS_FOR, len(label))]
        expected = [np.average(label[failed] == concept, weights=weight_N[failed]) for weight_N in weights]
        assert shares == pytest.approx([*expected, float(concept == "pose")])
    told = shares_in_words(measured, "rooms", "Rooms")
    assert told.startswith("Rooms, from the global method's pose:") and told.endswith("too few to conclude from.")


def test_counts_are_of_data_sets_conditions_and_strata(measured, causes):
    tested = causes.subset(causes.rows("test"))
    label = labels_of(tested.truth)
    of_all = counts_of(measured, "rooms", NATURAL, EVERY)
    natural = np.arange(len(label)) % 4 != 3
    assert of_all["registrations"] == natural.sum() and of_all["clusters"] == 3
    assert of_all[NOMINAL] == (label[natural] == NOMINAL).sum()
    assert of_all["pose"] + of_all["noise"] + of_all["overlap"] <= (~np.isin(label, (NOMINAL, BORDERLINE))).sum()
    pooled = counts_of(measured, POOLED, NATURAL, EVERY)
    assert pooled["registrations"] == 2 * of_all["registrations"]
    parts = [counts_of(measured, "rooms", NATURAL, stratum) for stratum in ("overlap_0.1_0.5", "overlap_0.5_1")]
    assert sum(part["registrations"] for part in parts) == of_all["registrations"]
    assert counts_of(measured, "rooms", f"{ADDED}_2", EVERY)["registrations"] == (~natural).sum()
    kinds = [counts_of(measured, "rooms", f"{NATURAL}_{kind}", EVERY) for kind in ("ladder", "global")]
    assert sum(kind["registrations"] for kind in kinds) == of_all["registrations"]


def test_the_tables_show_every_row_and_count_what_they_are_of(measured):
    text = table18_scan_causes(run_of(), measured).markdown()
    assert "| All together (" in text
    assert "| Distances of the pair (forest) | other scenes | pair + motion + further runs |" in text
    assert "| Chance | objects | nothing |" in text and "| Inlier RMSE (gate) | other scenes | pair |" in text
    assert "Rooms (procedural stand-in): " in text and " registrations of " in text and "in 3 scenes" in text
    counts = table18_scan_counts(run_of(), measured).markdown()
    assert "| Rooms (procedural stand-in) | Natural: ladder of errors | 0.1 to 0.5 |" in counts
    assert "| Things (procedural stand-in) | 2 times the sensor's noise added | all |" in counts


@pytest.mark.parametrize(
    ("counts", "words"),
    [({**dict.fromkeys(CONCEPTS, 9.0), NOMINAL: 40.0}, "27 failed, 40 nominal: too few"),
     ({**dict.fromkeys(CONCEPTS, 20.0), NOMINAL: 29.0}, "60 failed, 29 nominal: too few")],
)  # fmt: skip
def test_below_thirty_failed_or_nominal_no_row_is_bold(counts, words, measured):
    few = measured.copy()
    for label, count in counts.items():
        few.loc[few["metric"] == f"count_{label}", "value"] = count
    text = table18_scan_causes(run_of(), few).markdown()
    assert f"({words})" in text and "**" not in text.split("| Scans |")[1].split("\n\n")[0]


def test_the_figure_has_a_panel_for_each_data_set_and_kind_of_start(measured):
    figure = scan_failures(run_of(), measured)
    titles = [panel.get_title() for panel in figure.axes]
    assert titles[0].replace("\n", " ") == "Rooms (procedural stand-in), started on the ladder" and len(titles) == 4
    of = counts_of(measured, "rooms", f"{NATURAL}_ladder", "overlap_0.1_0.5")
    widths = [patch.get_width() for patch in figure.axes[0].patches if patch.get_y() < 0.3]
    assert sum(widths) == pytest.approx(100)
    assert any(width == pytest.approx(100 * of[NOMINAL] / of["registrations"]) for width in widths)
    assert f"$n$ = {of['registrations']}" in [text.get_text() for text in figure.axes[0].texts]
    with pytest.raises(InputError, match="has no natural registrations of these data sets"):
        scan_failures(run_of("other"), measured)


def test_files_of_other_samples_and_missing_predictions_are_one_line(files, tmp_path):
    rows = pd.read_csv(files["sample_files"][0])
    write_csv(tmp_path / "others.csv", rows.assign(sample=rows["sample"] + 50))
    swapped = files | {"sample_files": [tmp_path / "others.csv", files["sample_files"][1]]}
    with pytest.raises(InputError, match="its samples differ from those of the causes or the predictions"):
        collect(run_of(), **swapped)
    said = pd.read_csv(files["prediction_files"][0])
    write_csv(tmp_path / "seed100.csv", said[said["scans"] == "rooms"])
    with pytest.raises(InputError, match="its samples differ"):
        collect(run_of(), **files | {"prediction_files": [tmp_path / "seed100.csv"]})
    with pytest.raises(InputError, match="no files were given"):
        collect(run_of(), [], [], [])
