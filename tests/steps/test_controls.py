from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest

from baselines.pair import PairGPCA
from baselines.residuals import logistic
from gpca.encoders.registry import EncoderSettings
from gpca.steps.control_samples import ControlSettings, encode, of_unseen_objects

from .six_objects import Head, Nearest, attached, experiment, rival, seen


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


def test_hard_samples_are_learned_from_and_asked_about_as_they_are(six):
    hard = six.subset(np.arange(len(six) - 1, -1, -2))  # others than those of the paper's protocol
    made = experiment(six, "hard", "shuffled", embeddings={"hard": attached(hard)})
    found = replace(made, hard=hard).run(six, {})
    assert found.groupby("control")["sample"].nunique().to_dict() == {"paper": 18, "hard": 9, "shuffled": 18}
    of_hard = found[(found["control"] == "hard") & (found["explainer"] == "nearest")]
    tested = hard.subset(hard.rows("test"))
    assert of_hard["sample"].tolist() == tested.sample.tolist()
    assert of_hard["concept_true"].tolist() == tested.concept.tolist()
    assert share_right(found, control="hard", explainer="nearest") == 1


def test_hard_samples_of_other_sources_are_learned_from_but_no_embeddings_and_no_tested_family(six):
    tested = np.unique(six.cluster)[:2]
    hard = replace(six, split=np.where(np.isin(six.cluster, tested), "test", "train"))
    other = replace(hard, split=np.full(len(six), "train"), attached={})
    learned = {}

    class Learner(Head):
        def fit(self, registrations):
            learned[self.name] = registrations

    rivals = {
        reads: rival(type(reads, (Learner,), {"name": reads}), reads) for reads in ("embeddings", "registrations")
    }
    made = experiment(six, "hard", embeddings={"hard": attached(hard)}, rivals=rivals)
    replace(made, hard=hard, other_hard=[other]).explain_hard("embeddings")
    replace(made, hard=hard, other_hard=[other]).explain_hard("registrations")
    own = np.isin(hard.cluster, tested, invert=True).sum()
    assert len(learned["embeddings"]) == own and len(learned["registrations"]) == 2 * own
    assert not np.isin(learned["registrations"].cluster, tested).any()


def test_what_a_source_does_not_admit_is_left_out_and_named(registrations, capsys):
    found = experiment(registrations, "unseen_objects", "hard", "shuffled", "transfer").run(registrations, {})
    assert set(found["control"]) == {"paper", "shuffled"}
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "controls of tiny: 'unseen_objects' is skipped: it needs at least 5 objects, but there are 3",
        "controls of tiny: 'hard' is skipped: it needs samples of its own",
        "controls of tiny: 'transfer' is skipped: it needs at least two sources",
    ]


def test_shuffled_labels_are_learned_in_parts_and_every_test_sample_is_asked_about_once(six, monkeypatch):
    monkeypatch.setattr("gpca.steps.controls.FEWEST_OF_PART", 12)
    learned = []

    class Counting(Nearest):
        def fit(self, registrations):
            learned.append(registrations.sample.tolist())
            super().fit(registrations)

    found = experiment(six, "shuffled", rivals={"counting": rival(Counting, "embeddings")}).run(six, {})
    assert [len(samples) for samples in learned] == [36, 12, 12, 12]
    assert sorted(sample for samples in learned[1:] for sample in samples) == learned[0]
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
    experiment(six, "label_noise_30", rivals={"spy": rival(Spy, "embeddings")}).run(six, {})


def test_what_is_measured_of_a_registration_is_measured_once_for_all_controls(six, monkeypatch):
    import gpca.pairs.distances as registered

    measured = []
    describe = registered.describe_registrations
    monkeypatch.setattr(
        registered, "describe_registrations", lambda r, *a, **k: measured.append(len(r)) or describe(r, *a, **k)
    )
    rivals = {
        "pair": rival(
            partial(PairGPCA, True, "tiny", 100, points=32, iterations=2, inducing=4, draws=10), "registrations"
        ),
        "residuals": rival(partial(logistic, "tiny", 100), "uncertainty/removal"),
    }
    found = experiment(six, "label_noise_30", "shuffled", rivals=rivals).run(six, {})
    assert measured == [len(six)]
    assert found.groupby(["control", "explainer"]).size().tolist() == [18] * 6
    alone = experiment(replace(six, attached={}), "shuffled", rivals={"residuals": rivals["residuals"]}).run(six, {})
    both = found[(found["explainer"] == "residuals") & (found["control"] != "label_noise_30")]
    assert np.allclose(alone["entropy"], both["entropy"])


class WithEncoder(Nearest):
    """Its encoder finds the concept, if it was trained; it has measured nothing."""

    learned: ClassVar[list] = []

    def learn_encoder(self, registrations):
        self.learned.append(registrations.concept.tolist())
        return lambda asked: replace(asked, attached={**asked.attached, "embedding": seen(asked)[0]})


def test_an_encoder_of_an_explainer_is_trained_once_for_all_labels_and_anew_for_other_samples(six):
    WithEncoder.learned.clear()
    of_unseen = of_unseen_objects(six, 3, "tiny", 100)
    made = experiment(
        *(six, "density", "unseen_objects", "reversed", "label_noise_30", "shuffled", "transfer"),
        embeddings={"density": attached(six), "unseen_objects": attached(of_unseen)},
        rivals={"own": rival(WithEncoder, "registrations")},
    )
    found = made.run(six, {"other": six})
    of_paper, of_density, of_known = WithEncoder.learned
    assert of_paper == of_density == six.concept[six.split == "train"].tolist()
    assert of_known == of_unseen.concept[of_unseen.split == "train"].tolist()
    assert all(share_right(found, control=control) == 1 for control in ("density", "unseen_objects", "transfer"))


@pytest.mark.parametrize(
    ("control", "head", "fewest_points"), [("density", "linear", 32), ("unseen_objects", "linear", None)]
)
def test_an_encoder_is_trained_as_its_control_says(six, monkeypatch, control, head, fewest_points):
    given = []
    monkeypatch.setattr("gpca.encoders.training.train_encoder", lambda *given_: given.append(given_) or (None, []))
    monkeypatch.setattr("gpca.encoders.training.embed", lambda model, asked, *_: seen(asked))
    arrays, _ = encode(control, six, "tiny", 100, ControlSettings(draw_points=(32, 64)), EncoderSettings())
    learned, settings = given[0][0], given[0][3]
    assert (settings.head, settings.fewest_points) == (head, fewest_points)
    expected = six if control == "density" else of_unseen_objects(six, 3, "tiny", 100)
    assert np.array_equal(learned.split, expected.split) and len(arrays["h"]) == len(expected)
