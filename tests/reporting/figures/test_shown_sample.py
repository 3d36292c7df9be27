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
    assert stages.words(row, "icp") == "nominal, ADD-S 1.2 % $d$"


def test_a_concept_without_test_samples_is_refused(stages, stage_files):
    with pytest.raises(InputError, match=r"registrations\.npz: holds no test sample of 'blur'"):
        stages.choose("blur", stage_files[0])


def test_clouds_are_those_of_the_file_and_icp_undone(stages):
    of = stages.registrations
    row = int(of.rows("test")[0])
    target, aligned = stages.clouds(row, "icp")
    np.testing.assert_allclose(target, of.target(row))
    np.testing.assert_allclose(aligned, of.cloud(row), atol=1e-6)
    _, initial = stages.clouds(row, "init")
    step = of.T_target_source("icp", row) @ np.linalg.inv(of.T_target_source("init", row))
    np.testing.assert_allclose(initial @ step[:3, :3].T + step[:3, 3], aligned, atol=1e-6)


def test_one_rotation_shows_both_poses(stages):
    row = int(stages.registrations.rows("test")[1])
    seen = stages.seen(row)
    np.testing.assert_allclose(seen["init"][0], seen["icp"][0])
    for which, (_, source) in seen.items():
        np.testing.assert_allclose(np.linalg.norm(source, axis=1), np.linalg.norm(stages.clouds(row, which)[1], axis=1))


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
    registrations, embeddings, predictions = stage_files
    text = predictions.read_text()
    assert old in text
    (tmp_path / "predictions.csv").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=rf"predictions\.csv: .*({message})"):
        Stages.load(registrations, embeddings, tmp_path / "predictions.csv")
