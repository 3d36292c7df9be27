from dataclasses import replace
from functools import partial

import numpy as np

from baselines.pair import PairGPCA
from baselines.residuals import residuals_logistic
from gpca.controls.rivals import Rival
from gpca.controls.variants import of_unseen_objects

from .conftest import Head, Nearest, attached, experiment


def share_right(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    assert len(rows)
    return (rows["concept_true"] == rows["concept_predicted"]).mean()


def test_every_explainer_says_something_of_every_test_sample_under_every_control(six):
    of_unseen = of_unseen_objects(six, 3, "tiny", 100)
    found = experiment(
        *(six, "density", "unseen_objects", "reversed", "label_noise_30", "shuffled", "transfer"),
        embeddings={"density": attached(six), "unseen_objects": attached(of_unseen)},
    ).run(six, {"other": six})
    counts = found.groupby(["control", "tested", "explainer"]).size()
    assert counts["paper", "tiny"].to_dict() == {"nearest": 18, "head": 18}
    assert counts["transfer", "other"].to_dict() == {"nearest": 18, "head": 18}
    assert counts["unseen_objects", "tiny"].tolist() == [(of_unseen.split == "test").sum()] * 2
    assert set(found["split"]) == {"test"}
    # A head that is trained with its encoder learns no labels.
    assert counts["shuffled", "tiny"].to_dict() == counts["label_noise_30", "tiny"].to_dict() == {"nearest": 18}
    for control in ("paper", "density", "unseen_objects", "reversed", "transfer"):
        assert share_right(found, control=control, explainer="nearest") == 1
    assert share_right(found, control="shuffled", explainer="nearest") < 1


def test_what_a_source_does_not_admit_is_left_out_and_named(registrations, capsys):
    found = experiment(registrations, "unseen_objects", "shuffled", "transfer").run(registrations, {})
    assert set(found["control"]) == {"paper", "shuffled"}
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "controls of tiny: 'unseen_objects' is left out: it needs 5 objects or more, there are 3",
        "controls of tiny: 'transfer' is left out: it needs two sources or more",
    ]


def test_shuffled_labels_are_learnt_in_parts_and_every_test_sample_is_asked_about_once(six, monkeypatch):
    monkeypatch.setattr("gpca.controls.experiment.FEWEST_OF_PART", 12)
    learnt = []

    class Counting(Nearest):
        def fit(self, registrations):
            learnt.append(registrations.sample.tolist())
            super().fit(registrations)

    found = experiment(six, "shuffled", rivals={"counting": Rival(Counting, "embeddings")}).run(six, {})
    assert [len(samples) for samples in learnt] == [36, 12, 12, 12]
    assert sorted(sample for samples in learnt[1:] for sample in samples) == learnt[0]
    assert sorted(found["sample"][found["control"] == "shuffled"]) == list(range(18))


def test_an_explainer_cannot_see_what_was_perturbed(six):
    class Spy:
        def fit(self, registrations):
            assert set(registrations.split) == {"train"}

        def explain(self, registrations):
            assert set(registrations.concept) == {""}
            assert np.isnan(registrations.severity_noise).all()
            return seen_by.explain(registrations)

    seen_by = Head()
    experiment(six, "label_noise_10", rivals={"spy": Rival(Spy, "embeddings")}).run(six, {})


def test_what_is_measured_of_a_registration_is_measured_once_for_all_controls(six, monkeypatch):
    import gpca.descriptors.registered as registered

    measured = []
    describe = registered.describe_registrations
    monkeypatch.setattr(
        registered, "describe_registrations", lambda r, *a, **k: measured.append(len(r)) or describe(r, *a, **k)
    )
    rivals = {
        "pair": Rival(partial(PairGPCA, "tiny", 100, points=32, iterations=2, inducing=4, draws=10), "registrations"),
        "residuals": Rival(partial(residuals_logistic, "tiny", 100), "uncertainty/removal"),
    }
    found = experiment(six, "label_noise_10", "shuffled", rivals=rivals).run(six, {})
    assert measured == [len(six)]
    assert found.groupby(["control", "explainer"]).size().tolist() == [18] * 6
    alone = experiment(replace(six, attached={}), "shuffled", rivals={"residuals": rivals["residuals"]}).run(six, {})
    both = found[(found["explainer"] == "residuals") & (found["control"] != "label_noise_10")]
    assert np.allclose(alone["entropy"], both["entropy"])
