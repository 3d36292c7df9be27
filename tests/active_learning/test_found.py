"""What the documentation says was found about new concepts, held against the reference run on real objects."""

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped

REFERENCE = ROOT / "results/reference/real"
TABLES = REFERENCE / "tables"
MOST = 400  # labels of a run where the concept is rare
PAGE = unwrapped("docs/active_learning.md")
CONCEPTS = ("noise", "pose", "overlap")


def test_what_was_found_of_new_concepts_stands_in_the_reference():
    tidy = pd.read_csv(TABLES / "table15_new_concepts.csv")
    rows = tidy.pivot(index=["source", "seen"], columns="quantity", values="mean").swaplevel()
    assert (rows.loc["pair", "within"] == 100).all()
    assert "every run on every dataset reaches 90 % within 20 labels" in PAGE
    unseen = rows.loc["unseen", [f"labels_{concept}" for concept in CONCEPTS]].stack()
    assert unseen[unseen < 60].index.tolist() == [("coffee_cup", "labels_overlap")]
    assert "60 labels do not reach 90 %, except for overlap on cups" in PAGE


def test_what_was_found_of_a_rare_concept_stands_in_the_reference():
    tidy = pd.read_csv(REFERENCE / "active_learning.csv")
    rare = tidy[(tidy["table"] == "active_learning/rare") & (tidy["metric"] == "labels_to_target")]
    labels = rare.groupby(["method", "source"])["value"].mean().round().astype(int)
    assert (rare[rare["source"] == "ycb"]["value"] == MOST).any()  # so the mean is a lower bound
    cups, linemod, ycb = labels["random"]
    bald = labels["bald_kmeans"]
    assert f"it takes {cups} on cups and more than {ycb} on YCB" in PAGE
    assert f"BALD with k-means still {bald['coffee_cup']} and {bald['ycb']}" in PAGE
    reasons = (ROOT / "gpca/comparison/reasons.csv").read_text()
    assert f"random sampling takes {cups}, {linemod} and more than {ycb} labels" in reasons
    assert f"BALD still {', '.join(map(str, bald[:-1]))} and {bald.iloc[-1]}" in reasons


def test_what_was_found_of_oracles_that_err_stands_in_the_reference():
    tidy = pd.read_csv(TABLES / "table15_oracle.csv")
    pair = tidy[(tidy["seen"] == "pair") & (tidy["strategy"] == "bald_kmeans")].set_index("quantity")["mean"]
    accuracy, labels = pair["accuracy_30"], pair["labels_30"]
    words = f"ends at {accuracy.min():.0f} to {accuracy.max():.0f} %, with at most {labels.max():.0f} labels to 90 %"
    assert words in PAGE


def test_what_was_found_of_streams_stands_in_the_reference():
    rows = pd.read_csv(TABLES / "table3_stream.csv").pivot(
        index=["strategy", "source"], columns="quantity", values="mean"
    )
    delay = rows[[f"delay_{concept}" for concept in CONCEPTS]]

    def span(strategy):
        return f"{delay.loc[strategy].min().min():.0f} to {delay.loc[strategy].max().max():.0f} arrivals"

    assert f"after {span('stream_clever')} and is the most accurate on LINEMOD and YCB" in PAGE
    assert f"BALD over a threshold takes {span('stream_bald')}" in PAGE
    assert f"random requests take {delay.loc['stream_random'].min().min():.0f} or more" in PAGE
    for source in ("linemod", "ycb"):
        assert rows.xs(source, level="source")["final_accuracy"].idxmax() == "stream_clever"
