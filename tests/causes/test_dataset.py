import numpy as np
import pytest

from gpca.causes.dataset import COLUMNS, Causes
from gpca.errors import InputError
from gpca.io.arrays import save_arrays


@pytest.fixture
def file(causes, tmp_path):
    causes.save(tmp_path / "seed100.npz")
    return tmp_path / "seed100.npz"


def test_causes_survive_the_file(causes, file, tmp_path):
    loaded = Causes.load(file)
    for name in COLUMNS:
        assert np.array_equal(getattr(loaded, name), getattr(causes, name))
    for name in ("truth", "truth_again"):
        assert np.array_equal(getattr(loaded, name).error, getattr(causes, name).error)
        assert getattr(loaded, name).state.tolist() == getattr(causes, name).state.tolist()
    loaded.save(tmp_path / "again.npz")
    assert file.read_bytes() == (tmp_path / "again.npz").read_bytes()


def test_rows_keep_their_truths(causes):
    rows = causes.rows("test")[[4, 1]]
    chosen = causes.subset(np.concatenate([rows, causes.rows("train")[:2]]))
    assert np.array_equal(chosen.truth.error[:2], causes.truth.error[rows])
    assert np.array_equal(chosen.truth_again.error, causes.truth_again.error[[4, 1]])
    assert np.array_equal(chosen.registrations.cloud(0), causes.registrations.cloud(rows[0]))
    assert chosen.applied.shape == (4, 3)


def at(*index, value):
    def change(array):
        array = array.copy()
        array[index] = value
        return array

    return change


FAULTS = [
    ("error", lambda a: a[:, :4], "array 'error' is 20×4, not 20×8"),
    ("error", at(0, 0, value=np.nan), "array 'error' contains NaN"),
    ("error", at(0, 0, value=-0.1), "'error' contains impossible values"),
    ("error", at(0, 0, value=0.6), "'error' contains impossible values"),
    ("error_again", lambda a: a[:-1], "array 'error_again' is 7×8, not 8×8"),
    ("uncertainty", at(0, 0, value=1.0), "'uncertainty' contains impossible values"),
    ("applied", lambda a: a.astype(float), "array 'applied' has type float64"),
    ("applied", lambda a: ~a, "'error' contains impossible values"),
    ("fitness_runs", lambda a: a + 1.5, "'fitness_runs' contains impossible values"),
    ("inlier_rmse_runs", lambda a: a - 1, "'inlier_rmse_runs' contains impossible values"),
    ("T_target_source_runs", lambda a: a[::-1], "'T_target_source_runs' contains impossible values"),
    ("T_target_source_runs", lambda a: a[:, :, :3], "array 'T_target_source_runs' is 20×13×3×4"),
    ("object_name", lambda a: np.full_like(a, "one"), "'object_name' contains impossible values"),
    ("nominal_limit", lambda a: a * 10, "'failed_limit' contains impossible values"),
    ("cause_limit", lambda a: -a, "'cause_limit' contains impossible values"),
    ("severity_outliers", lambda a: a + 2, "'severity_outliers' contains impossible values"),
    ("candidate", lambda a: a - 10**6, "'candidate' contains impossible values"),
    ("truth", None, "array 'symmetric' is missing"),
    ("concept", lambda a: np.full(len(a), "dust"), "unknown concept 'dust'"),
]


@pytest.mark.parametrize(("name", "damage", "message"), FAULTS)
def test_faulty_files_are_refused_with_their_name(file, name, damage, message):
    with np.load(file) as archive:
        arrays = dict(archive)
    if damage is None:
        del arrays["symmetric"]
    else:
        arrays[name] = damage(arrays[name])
    save_arrays(file, arrays)
    with pytest.raises(InputError, match=message) as caught:
        Causes.load(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "python -m gpca causes" in str(caught.value) or "expected one of" in str(caught.value)
