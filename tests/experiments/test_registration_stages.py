"""Registrations with the results of all stages."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.experiments.registration_stages import Staged


@pytest.fixture(scope="module")
def stages(stage_files):
    return Staged.load(*stage_files)


def of_test(stages, concept):
    rows = stages.predictions
    return rows[(rows["split"] == "test") & (rows["concept_true"] == concept)]


def test_the_sample_shown_failed_and_is_more_uncertain_than_clean_pairs(stages, stage_files, monkeypatch):
    monkeypatch.setattr(Staged, "error", lambda self, row: 0.05 if self.registrations.sample[row] % 2 else 0.012)
    failed = [r for r in of_test(stages, "pose").index if stages.error(r) > 0.03]
    uncertain = [r for r in failed if stages.u_S[r] > stages.u_clean]
    assert stages.u_clean == 1
    assert 0 < len(uncertain) < len(failed)
    row = stages.choose("pose", stage_files[0])
    scores = stages.predictions["score_pose"]
    assert row == sorted(uncertain, key=scores.get)[(len(uncertain) - 1) // 2]
    assert stages.words(row, "icp") == f"failed, ADD-S 5.0 % $d$\n$u$ = {stages.u_S[row]:.1f} nats (clean: < 1.0)"


def test_another_concept_is_shown_where_none_of_the_first_failed(stages, stage_files, monkeypatch):
    poses = set(of_test(stages, "pose").index)
    monkeypatch.setattr(Staged, "error", lambda self, row: 0.05 if row in poses else 0.012)
    row = stages.choose("overlap", stage_files[0], "overlap", "noise", "pose")
    assert row == stages.choose("pose", stage_files[0])
    alone = stages.choose("overlap", stage_files[0])  # has none that failed, but some that are uncertain
    assert stages.predictions["concept_true"][alone] == "overlap"
    assert stages.u_S[alone] > stages.u_clean


def test_where_none_is_uncertain_the_fit_is_a_poor_one(stages, stage_files, monkeypatch):
    monkeypatch.setattr(Staged, "error", lambda self, row: 0.012)
    stages = replace(stages, u_clean=9.0)
    row = stages.choose("pose", stage_files[0])
    test = of_test(stages, "pose")
    assert stages.registrations.fitness[row] <= np.median(stages.registrations.fitness[test.index])
    number = stages.registrations.sample[row]
    assert stages.words(row, "icp") == f"nominal, ADD-S 1.2 % $d$\n$u$ = {number / 10:.1f} nats (clean: < 9.0)"
    of_training = int(stages.registrations.rows("train")[0])
    assert stages.words(of_training, "icp") == "nominal, ADD-S 1.2 % $d$"  # whose uncertainty is not measured


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n0,test,", "\n99,test,", "its samples differ from"),
        ("bald", "entropy_", "column 'entropy_' is unknown"),
        ("0.0144", "", "not finite numbers"),
    ],
)
def test_predictions_that_do_not_fit_are_refused(stage_files, tmp_path, old, new, message):
    registrations, embeddings, predictions, *others = stage_files
    text = predictions.read_text()
    assert old in text
    (tmp_path / "predictions.csv").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=rf"predictions\.csv: .*({message})"):
        Staged.load(registrations, embeddings, tmp_path / "predictions.csv", *others)
