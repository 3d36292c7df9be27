import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.active_learning.tables import table3_active_learning, table3_extended, table3_stream

REAL = {"linemod": {"title": "LINEMOD", "stand_in": False}, "ycb": {"title": "YCB", "stand_in": False}}
STAND_INS = {name: entry | {"stand_in": True} for name, entry in REAL.items()}
STRATEGIES = {
    "random": "Random", "random_stratified": "Told", "bald_kmeans": "BALD + k-means", "stream_bald": "Stream",
}  # fmt: skip
CONDITIONS = {
    "initial": 120, "train": 800, "test": 200, "labels": 60, "batch": 4, "target": 0.9, "iterations": 100,
    "stream": {"arrivals": 400, "quiet": 100, "budget": 0.1},
    "rare": {
        "shares": [0.05, 0.01], "labels": 550, "least": 60, "batch": 4, "late_batch": 10,
        "gpc": {"kernel": "rbf", "learning_rate": 0.01, "iterations": 100},
    },
}  # fmt: skip
CLUSTERS = {("ycb", seed): 11 for seed in range(3)}


def wilson(percent):
    """The bounds of a share of all families of three seeds."""
    low, high = (100 * bound for bound in wilson_interval(percent / 100 * 33, 33))
    return f"{low:.1f} to {high:.1f}"


AT_96 = f"96.0 ({wilson(96)})"


def tidy(values):
    """Metrics from {(setting, source, strategy, concept, metric): values over seeds}."""
    return pd.DataFrame(
        [
            (f"active_learning/{setting}", source, strategy, metric, concept, seed, value)
            for (setting, source, strategy, concept, metric), of_seeds in values.items()
            for seed, value in enumerate(of_seeds)
        ],
        columns=list(TIDY_COLUMNS),
    )


@pytest.fixture
def metrics():
    of_ycb = ("pretrained", "ycb")
    return tidy(
        {
            (*of_ycb, "bald_kmeans", "overlap", "labels_to_target"): [12, 16, 20],
            (*of_ycb, "bald_kmeans", "overlap", "reached"): [1, 1, 1],
            (*of_ycb, "bald_kmeans", "overlap", "final_accuracy"): [0.95, 0.96, 0.97],
            (*of_ycb, "bald_kmeans", "overlap", "area_under_curve"): [0.8, 0.8, 0.8],
            (*of_ycb, "bald_kmeans", "pose", "area_under_curve"): [0.6, 0.6, 0.6],
            (*of_ycb, "bald_kmeans", "overlap", "area_gain"): [-0.1, 0.0, 0.1],
            (*of_ycb, "bald_kmeans", "noise", "labels_to_target"): [2, 2, 2],
            (*of_ycb, "random", "overlap", "labels_to_target"): [40, 60, 44],
            (*of_ycb, "random", "overlap", "reached"): [1, 0, 1],
            (*of_ycb, "random", "overlap", "area_under_curve"): [0.75, 0.75, 0.75],
            (*of_ycb, "random_stratified", "overlap", "area_under_curve"): [0.9, 0.9, 0.9],
            (*of_ycb, "stream_bald", "overlap", "delay"): [60, 70, 50],
            (*of_ycb, "stream_bald", "overlap", "recognised"): [1, 1, 1],
            (*of_ycb, "stream_bald", "overlap", "final_accuracy"): [0.9, 0.9, 0.9],
            ("unseen", "ycb", "random", "overlap", "labels_to_target"): [60, 60, 60],
            ("unseen", "ycb", "random", "overlap", "reached"): [0, 0, 0],
            ("rare_5", "ycb", "bald_kmeans", "overlap", "labels_to_target"): [10, 11, 12],
            ("rare_5", "ycb", "bald_kmeans", "overlap", "epochs_at_target"): [60, 70, 80],
            ("rare_5", "ycb", "bald", "overlap", "labels_to_target"): [14, 16, 18],
            ("rare_5", "ycb", "random", "overlap", "labels_to_target"): [200, 250, 300],
            ("rare_1", "ycb", "random", "overlap", "labels_to_target"): [400, 400, 400],
        }
    )


def test_table3_shows_the_papers_experiment_alone(metrics):
    markdown = table3_active_learning(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS).markdown()
    assert "| Dataset | Encoder saw | Labels, BALD + k-means | Labels, BALD | Labels, random |" in markdown
    rows = [line for line in markdown.splitlines() if line.startswith("| YCB")]
    assert rows[0].startswith("| YCB | all concepts; 5 % of the pool new | **11 ± 2** | 16 ± 5 | 250 ± 124 |")
    assert rows[0].endswith("| 70 ± 25 |")
    assert rows[1].startswith("| YCB | all concepts; 1 % of the pool new | – | – | 400 ± 0 |")
    # Two of three random runs reached the target: their mean is a lower bound, without an interval, and never bold.
    assert f"| YCB | all concepts | **16 ± 10** | – | > 48 | {AT_96} |" in markdown
    assert "| YCB | the known concepts only | – | – | > 60 |" in markdown
    assert "LINEMOD" not in markdown


def test_accuracies_have_the_farther_bounds_of_those_over_seeds_and_families(metrics):
    table = table3_active_learning(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS)
    note = table.footnotes[0]
    assert "± is the half-width of the 95 % t-interval over the seeds" in note
    assert "the farther bounds of that and of Wilson's interval, for which a family of objects counts once" in note
    few = dict.fromkeys(CLUSTERS, 2)
    wider = table3_active_learning(metrics, few, REAL, STRATEGIES, CONDITIONS)
    assert wider.cells[2, "accuracy_bald_kmeans"].bounds[0] < table.cells[2, "accuracy_bald_kmeans"].bounds[0]
    assert wider.cells[2, "labels_bald_kmeans"] == table.cells[2, "labels_bald_kmeans"]  # no share of samples


def test_table3_states_its_conditions(metrics):
    markdown = table3_active_learning(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS).markdown()
    judged = ("(rbf, rate 0.01, 100 passes)", "at least 60 (then 10 a round), at most 550 or the whole pool")
    for words in ("120 labeled samples", "680 training samples", "4 labels a round, 60 in all", *judged):
        assert words in markdown
    assert "Mean over 3 seeds, 200 test samples each" in markdown


def test_without_a_rare_concept_nothing_is_said_of_it(metrics):
    table = table3_active_learning(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS | {"rare": None})
    assert not [note for note in table.footnotes if "percent of the pool" in note or "Other rows" in note]
    assert [label for _, (label, _) in table.rows] == ["pretrained", "unseen"]


def test_the_csv_marks_lower_bounds(metrics):
    records = table3_active_learning(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS).records()
    assert ("ycb", "pretrained", "labels_random", 48.0, "", "", 3, 600, True) in records
    assert ("ycb", "pretrained", "labels_bald_kmeans", 16.0, 6.063449, 25.936551, 3, 600, False) in records


def test_extended_averages_over_the_concepts_held_out_and_leaves_the_oracle_out_of_the_comparison(metrics):
    markdown = table3_extended(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS).markdown()
    assert "Labels, overlap" in markdown
    [bald] = [line for line in markdown.splitlines() if "BALD + k-means" in line and "YCB" in line]
    assert f"70.0 ({wilson(70)})" in bald  # all seeds agree
    assert "**0.0 ± 24.8**" not in bald
    [told] = [line for line in markdown.splitlines() if "Told" in line]
    assert "**" not in told
    assert f"**75.0 ({wilson(75)})**" in markdown
    assert "Stream" not in markdown


def test_stream_shows_streams_alone(metrics):
    markdown = table3_stream(metrics, CLUSTERS, REAL, STRATEGIES, CONDITIONS).markdown()
    assert "| YCB | Stream |" in markdown
    assert "60 ± 25" in markdown
    assert "Random" not in markdown
    assert "400 samples arrive one by one; the first 100" in markdown


@pytest.mark.parametrize("make", [table3_active_learning, table3_extended, table3_stream])
def test_stand_ins_are_said_and_nothing_to_show_is_a_fault(metrics, make):
    table = make(metrics, CLUSTERS, STAND_INS, STRATEGIES, CONDITIONS)
    assert "on procedural stand-ins" in table.caption
    assert "YCB (procedural stand-in)" in table.markdown()
    assert table.latex().count("{") == table.latex().count("}")
    with pytest.raises(InputError, match="has nothing to show"):
        make(metrics[:0], CLUSTERS, REAL, STRATEGIES, CONDITIONS)
