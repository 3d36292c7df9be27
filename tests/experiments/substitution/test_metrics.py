import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.substitution.metrics import collect, collect_intervals

CONCEPTS = ("noise", "pose", "overlap")


def row(exchanged, learnt_from, asked_of, explainer, sample, true, named, failure=""):
    known = {"exchanged": exchanged, "learnt_from": learnt_from, "asked_of": asked_of, "explainer": explainer}
    said = {"sample": sample, "split": "test", "object": "mug", "cluster": "mug"}
    said |= {"concept_true": true, "concept_predicted": named}
    scores = {f"score_{concept}": 0.0 for concept in CONCEPTS}
    return known | said | {"abstained": named == "", "icp_calls": 0, **scores, "failure": failure}


@pytest.fixture
def path(tmp_path):
    rows = []
    for estimator, named in {"monte_carlo": ("pose", "pose"), "censi": ("noise", ""), "bonnabel": ("", "")}.items():
        refused = "refused" if estimator == "bonnabel" else ""
        for sample, true in enumerate(("noise", "pose")):
            rows.append(row("estimator", estimator, estimator, "shap", sample, true, named[sample], refused))
    for learnt_from in ("icp", "gicp"):
        for asked_of in ("icp", "gicp"):
            for sample, true in enumerate(("noise", "pose")):
                right = learnt_from == asked_of or sample == 0
                failed = "lost" if asked_of == "gicp" and sample == 1 else ""
                named = true if right else "overlap"
                rows.append(row("method", learnt_from, asked_of, "gpca", sample, true, named, failed))
    path = tmp_path / "exchange" / "ycb" / "seed3.csv"
    path.parent.mkdir(parents=True)
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def values(path, **wanted):
    rows = collect([path])
    assert set(rows["seed"]) == {3} and set(rows["source"]) == {"ycb"}
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows.set_index(["method", "concept", "metric"])["value"].to_dict()


def test_estimators_are_judged_by_concept_and_beside_monte_carlo(path):
    found = values(path, table="shap")
    assert found["monte_carlo", "all", "accuracy"] == 0.5
    assert found["monte_carlo", "pose", "accuracy"] == 1 and found["monte_carlo", "noise", "accuracy"] == 0
    assert found["monte_carlo", "all", "agreement"] == 1 and found["censi", "all", "agreement"] == 0
    assert found["censi", "all", "abstained"] == 0.5 and found["censi", "all", "no_estimate"] == 0
    assert found["bonnabel", "all", "accuracy"] == 0 and found["bonnabel", "all", "no_estimate"] == 1
    assert found["bonnabel", "all", "abstained"] == 0
    assert found["censi", "noise", "test_samples"] == 1


def test_methods_are_judged_by_what_was_learned_from_and_over_all_others(path):
    found = values(path, table="gpca", metric="accuracy")
    assert found["icp", "icp", "accuracy"] == 1 and found["gicp", "icp", "accuracy"] == 0.5
    assert found["another", "gicp", "accuracy"] == 0.5
    assert values(path, table="gpca", metric="failed")["gicp", "icp", "failed"] == 0.5


def test_intervals_are_of_the_same_shares_over_families_of_all_sources(path, tmp_path):
    other = tmp_path / "exchange/cups/seed3.csv"
    other.parent.mkdir()
    other.write_text(path.read_text())
    found = collect_intervals([path, other])
    single = collect([path])
    shares = single[single["metric"] != "test_samples"].set_index(["table", "method", "metric", "concept"])["value"]
    found = found.set_index(["table", "method", "metric", "concept"])
    assert set(found.index) == set(shares.index)
    assert (found["value"] == shares[found.index]).all()
    row = found.loc["gpca", "another", "accuracy", "gicp"]
    assert (row["source"], row["seeds"], row["clusters"], row["samples"]) == ("pooled", 1, 2, 4)
    assert (found["low"] < found["high"]).all()


def test_agreement_is_with_the_same_sample_of_the_same_source_and_seed(path, tmp_path):
    other = tmp_path / "exchange/cups/seed4.csv"
    other.parent.mkdir()
    rows = pd.read_csv(path, keep_default_na=False)
    rows.loc[rows["asked_of"] == "censi", "concept_predicted"] = "pose"  # as Monte-Carlo says
    rows.loc[rows["asked_of"] == "censi", "abstained"] = False
    rows.to_csv(other, index=False)
    found = collect_intervals([path, other]).set_index(["method", "metric"])["value"]
    assert found["censi", "agreement"] == 0.5


def test_what_is_neither_is_refused(path):
    path.write_text(path.read_text().replace("estimator,", "encoder,", 1))
    with pytest.raises(InputError, match="exchanges 'encoder'; expected method or estimator"):
        collect([path])
    with pytest.raises(InputError, match="no files were given"):
        collect([])
