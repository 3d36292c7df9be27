import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gpca.arrays import load_arrays, save_arrays
from gpca.errors import InputError
from gpca.files import whole_file, whole_folder

ROOT = Path(__file__).resolve().parents[1]
SHAPES = {"points": ("P", 3), "labels": ("P",)}
GOOD = {"points": np.arange(12.0).reshape(4, 3), "labels": np.array(["a", "b", "a", "b"])}


def test_a_file_appears_whole_under_its_name_and_makes_its_folder(tmp_path):
    path = tmp_path / "new" / "table.csv"
    with whole_file(path) as partial:
        partial.write_text("half")
        assert not path.exists()
        assert (partial.parent, partial.suffix) == (path.parent, path.suffix)
        partial.write_text("whole")
    assert path.read_text() == "whole"
    assert os.listdir(path.parent) == ["table.csv"]


@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt])
def test_a_failure_leaves_the_old_file_and_nothing_beside_it(tmp_path, fault):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(fault), whole_file(path) as partial:
        partial.write_text("half of the new")
        raise fault
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["table.csv"]


def test_arrays_survive_the_file_and_give_the_same_bytes_twice(tmp_path):
    first, second = tmp_path / "a.npz", tmp_path / "b.npz"
    save_arrays(first, GOOD)
    loaded = load_arrays(first, SHAPES, "python -m gpca objects")
    for name, array in GOOD.items():
        assert loaded[name].dtype == array.dtype
        assert np.array_equal(loaded[name], array)
    save_arrays(second, loaded)
    assert first.read_bytes() == second.read_bytes()


def test_objects_are_never_pickled(tmp_path):
    with pytest.raises(ValueError, match="allow_pickle"):
        save_arrays(tmp_path / "a.npz", {"points": np.array([{}], dtype=object)})
    assert os.listdir(tmp_path) == []


def truncate(path):
    save_arrays(path, GOOD)
    path.write_bytes(path.read_bytes()[:-100])


def change_a_byte(path):
    save_arrays(path, GOOD)
    content = bytearray(path.read_bytes())
    content[content.index(GOOD["points"].tobytes()) + 9] ^= 255
    path.write_bytes(content)


def one_array(path):
    with path.open("wb") as file:
        np.save(file, GOOD["points"])


def cut_header(path):
    import zipfile

    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("points.npy", b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f8',")


def arrays(**changed):
    return lambda path: np.savez(path, **(GOOD | changed))


@pytest.mark.parametrize(
    ("write", "expected"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "no such file"),
        (lambda path: path.write_bytes(b""), "not a readable npz"),
        (lambda path: path.write_bytes(b"version https://git-lfs.github.com/spec/v1\n"), "not a readable npz"),
        (truncate, "not a readable npz"),
        (change_a_byte, "not a readable npz"),
        (cut_header, "not a readable npz"),
        (one_array, "not a readable npz"),
        (arrays(points=np.array([{}] * 4, dtype=object)), "pickled objects"),
        (lambda path: np.savez(path, points=GOOD["points"]), "array 'labels' is missing"),
        (arrays(points=np.zeros((4, 2))), "array 'points' is 4×2, not 4×3"),
        (arrays(points=np.zeros(4)), "array 'points' is 4, not P×3"),
        (arrays(labels=np.array("a")), "array 'labels' is scalar, not 4"),
        (arrays(labels=np.array(["a"] * 5)), "array 'labels' is 5, not 4"),
        (arrays(points=np.full((4, 3), np.nan)), "array 'points' holds NaN"),
        (arrays(points=np.full((4, 3), np.inf, np.float32)), "array 'points' holds NaN or infinity"),
    ],
)
def test_faulty_files_are_refused_in_one_line(tmp_path, write, expected):
    path = tmp_path / "arrays.npz"
    write(path)
    with pytest.raises(InputError, match=expected) as caught:
        load_arrays(path, SHAPES, "python -m gpca objects")
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert line.endswith("with 'python -m gpca objects'")
    assert "\n" not in line


HALF = """
import sys, time
from gpca.files import whole_file, whole_folder
whole = {"file": whole_file, "folder": whole_folder}[sys.argv[1]]
with whole(sys.argv[2]) as partial:
    (partial / "two" if partial.is_dir() else partial).write_text("half of what was killed")
    print("half", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize(("kind", "whole"), [("file", whole_file), ("folder", whole_folder)])
def test_what_a_killed_run_leaves_is_hidden_and_gone_after_the_next_one(kind, whole, tmp_path):
    path = tmp_path / ("seed0.checkpoint" if kind == "file" else "scenes")
    of_another = tmp_path / (".seed01.partial.checkpoint" if kind == "file" else ".scenes2.partial")
    of_another.touch()
    with subprocess.Popen([sys.executable, "-c", HALF, kind, str(path)], stdout=subprocess.PIPE, cwd=ROOT) as killed:
        assert killed.stdout.readline() == b"half\n"
        killed.kill()
    assert not path.exists()
    (left,) = set(tmp_path.iterdir()) - {of_another}
    assert left.name.startswith(".")
    with whole(path) as partial:
        (partial if kind == "file" else partial / "one").write_text("whole")
    assert set(tmp_path.iterdir()) == {path, of_another}
    assert [file.read_text() for file in ([path] if kind == "file" else path.iterdir())] == ["whole"]
