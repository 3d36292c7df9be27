import numpy as np
import pytest

from gpca.errors import InputError
from gpca.reporting.figures.shown_sample import Stages


@pytest.fixture(scope="module")
def stages(stage_files):
    return Stages.load(*stage_files)


def test_the_sample_shown_is_a_test_sample_of_the_concept_after_a_poor_fit(stages, stage_files):
    row = stages.choose("pose", stage_files[0])
    sample = stages.predictions.iloc[row]
    assert (sample["split"], sample["concept_true"], sample["concept_predicted"]) == ("test", "pose", "pose")
    test = stages.predictions[(stages.predictions["split"] == "test") & (stages.predictions["concept_true"] == "pose")]
    failed = test[[stages.error(other) > 0.03 for other in test.index]]
    assert len(failed)
    assert failed["score_pose"].min() <= sample["score_pose"] <= failed["score_pose"].max()
    assert stages.words(row, "icp").startswith("failed, ADD-S")


def test_where_none_failed_the_fit_is_a_poor_one(stages, stage_files, monkeypatch):
    monkeypatch.setattr(Stages, "error", lambda self, row: 0.012)
    row = stages.choose("pose", stage_files[0])
    test = stages.predictions[(stages.predictions["split"] == "test") & (stages.predictions["concept_true"] == "pose")]
    assert stages.registrations.fitness[row] <= np.median(stages.registrations.fitness[test.index])
    assert stages.words(row, "icp") == f"nominal, ADD-S 1.2 % $d$\n$u$ = {sample_number(stages, row) / 10:.1f} nats"
    of_training = int(stages.registrations.rows("train")[0])
    assert stages.words(of_training, "icp") == "nominal, ADD-S 1.2 % $d$"  # whose uncertainty is not measured


def sample_number(stages, row):
    return stages.registrations.sample[row]


def test_states_follow_the_limits_of_the_config(stage_files, monkeypatch):
    *files, _ = stage_files
    monkeypatch.setattr(Stages, "error", lambda self, row: 0.012)
    assert Stages.load(*files, {"nominal": 0.001, "failed": 0.01}).state(0) == "failed"
    assert Stages.load(*files, {"nominal": 0.001, "failed": 0.02}).state(0) == "borderline"


def test_uncertainties_of_other_samples_are_refused(stage_files, tmp_path):
    *files, uncertainties, limits = stage_files
    (tmp_path / "seed0.csv").write_text(uncertainties.read_text().replace("\n", "\n99").removesuffix("99"))
    with pytest.raises(InputError, match=r"seed0\.csv: holds other samples than the registrations; make both anew"):
        Stages.load(*files, tmp_path / "seed0.csv", limits)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n0,test,", "\n99,test,", "holds other samples than"),
        ("bald", "doubt", "column 'bald' is missing"),
        ("0.0144", "", "not a finite number"),
        ("score_noise", "score_blur", "unknown concept|does not score"),
    ],
)
def test_predictions_that_do_not_fit_are_refused(stage_files, tmp_path, old, new, message):
    registrations, embeddings, predictions, *others = stage_files
    text = predictions.read_text()
    assert old in text
    (tmp_path / "predictions.csv").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=rf"predictions\.csv: .*({message})"):
        Stages.load(registrations, embeddings, tmp_path / "predictions.csv", *others)
