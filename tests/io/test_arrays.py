import os

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.io.arrays import load_arrays, save_arrays

SHAPES = {"points": ("P", 3), "labels": ("P",)}
GOOD = {"points": np.arange(12.0).reshape(4, 3), "labels": np.array(["a", "b", "a", "b"])}


def test_arrays_survive_the_file_with_the_same_bytes_twice_and_objects_are_never_pickled(tmp_path):
    with pytest.raises(ValueError, match="allow_pickle"):
        save_arrays(tmp_path / "a.npz", {"points": np.array([{}], dtype=object)})
    assert os.listdir(tmp_path) == []
    first, second = tmp_path / "a.npz", tmp_path / "b.npz"
    save_arrays(first, GOOD)
    loaded = load_arrays(first, SHAPES)
    for name, array in GOOD.items():
        assert loaded[name].dtype == array.dtype
        assert np.array_equal(loaded[name], array)
    save_arrays(second, loaded)
    assert first.read_bytes() == second.read_bytes()


def one_array(path):
    with path.open("wb") as file:
        np.save(file, GOOD["points"])


def arrays(**changed):
    return lambda path: np.savez(path, **(GOOD | changed))


@pytest.mark.parametrize(
    ("write", "expected"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.write_bytes(b"version https://git-lfs.github.com/spec/v1\n"), "not a readable npz"),
        (one_array, "not a readable npz"),
        (lambda path: np.savez(path, points=GOOD["points"]), "array 'labels' is missing"),
        (arrays(points=np.zeros((4, 2))), "array 'points' is 4×2, not 4×3"),
        (arrays(points=np.zeros(4)), "array 'points' is 4, not P×3"),
        (arrays(labels=np.array("a")), "array 'labels' is scalar, not 4"),
        (arrays(labels=np.array(["a"] * 5)), "array 'labels' is 5, not 4"),
        (arrays(points=np.full((4, 3), np.nan)), "array 'points' contains NaN"),
        (arrays(points=np.full((4, 3), np.inf, np.float32)), "array 'points' contains NaN or infinity"),
    ],
)
def test_faulty_files_are_refused_in_one_line(tmp_path, write, expected):
    path = tmp_path / "arrays.npz"
    write(path)
    with pytest.raises(InputError, match=expected) as caught:
        load_arrays(path, SHAPES)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert line.endswith("with Snakemake")
    assert "\n" not in line
