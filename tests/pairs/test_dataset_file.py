import numpy as np
import pytest

from gpca.errors import InputError
from gpca.pairs.dataset import Registrations


def test_registrations_survive_the_file(tmp_path, registrations):
    registrations.save(tmp_path / "a.npz")
    loaded = Registrations.load(tmp_path / "a.npz")
    for name, array in registrations.arrays.items():
        assert getattr(loaded, name).dtype == array.dtype
        assert np.array_equal(getattr(loaded, name), array)
    loaded.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def changed(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("name", "damage", "expected"),
    [
        ("concept", lambda a: a.astype(object), "pickled"),
        ("concept", lambda a: changed(a, 3, "dust"), "unknown concept 'dust'; expected one of noise, pose, overlap"),
        ("split", lambda a: changed(a.astype("U9"), 0, "validate"), "neither train nor test"),
        ("points", lambda a: a[:, :2], r"'points' is \d+×2, not \d+×3"),
        ("points", lambda a: changed(a, 5, np.nan), "'points' contains NaN"),
        ("points", lambda a: a[:-1], "'offsets' do not match"),
        ("offsets", lambda a: a[:-1], "'offsets' is 54, not 55"),
        ("target_points", lambda a: a[:-1], "'target_offsets' do not match"),
        ("target_offsets", lambda a: a[:-1], "'target_offsets' is 54, not 55"),
        ("offsets", lambda a: a[:0], "'offsets' is 0, not 55"),
        ("offsets", lambda a: changed(a, 1, a[2]), "fewer than 3 'points'"),
        ("offsets", lambda a: changed(a, 1, a[3]), "fewer than 3 'points'"),
        ("fitness", lambda a: a[:-1], r"'fitness' is 53, not 54"),
        ("T_target_source_icp", lambda a: a[:, :3], "54×3×4, not 54×4×4"),
        ("severity_crop", lambda a: None, "'severity_crop' is missing"),
    ],
)
def test_faulty_files_are_refused_with_their_name(tmp_path, registrations, name, damage, expected):
    path = tmp_path / "seed0.npz"
    arrays = (
        registrations.arrays
        | {"source": np.array("tiny"), "seed": np.array(0)}
        | {name: damage(getattr(registrations, name))}
    )
    np.savez(path, **{key: array for key, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=expected) as caught:
        Registrations.load(path)
    assert str(caught.value).startswith(f"{path}: ")
