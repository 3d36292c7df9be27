import numpy as np
import pytest

from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.io.arrays import save_arrays


@pytest.fixture
def file(causes, tmp_path):
    causes.save(tmp_path / "seed100.npz")
    return tmp_path / "seed100.npz"


def test_causes_survive_the_file(causes, file, tmp_path):
    loaded = Causes.load(file)
    for name in Causes.array_fields():
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


FAULTS = [
    ("error_again", lambda a: a[:-1], "array 'error_again' is 7×8, not 8×8"),
    ("applied", lambda a: a.astype(float), "array 'applied' has type float64"),
]


@pytest.mark.parametrize(("name", "damage", "message"), FAULTS)
def test_faulty_files_are_refused_with_their_name(file, name, damage, message):
    with np.load(file) as archive:
        arrays = dict(archive)
    arrays[name] = damage(arrays[name])
    save_arrays(file, {name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=message) as caught:
        Causes.load(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "with Snakemake" in str(caught.value) or "expected one of" in str(caught.value)
