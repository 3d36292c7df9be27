import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import load_model
from gpca.errors import InputError
from gpca.io.arrays import load_arrays
from gpca.io.csv_file import read_csv
from gpca.io.files import read_image, require_file, whole_file, whole_folder
from gpca.io.structured_text import read_json, read_mapping
from gpca.model.clouds import read_points, read_pose
from gpca.model.file import Model
from gpca.objects.bop import read_models_info
from gpca.objects.downloads import unpack
from gpca.objects.mesh_folder import read_surface

ROOT = Path(__file__).resolve().parents[2]


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


HALF = """
import sys, time
from gpca.io.files import whole_file, whole_folder
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


NOBODY = 65534
READERS = {
    "arrays.npz": lambda path: load_arrays(path, {"x": ("N",)}),
    "rows.csv": lambda path: read_csv(path, ["x"]),
    "weights.pt": lambda path: load_model(path, EncoderSettings()),
    "model.pt": Model.load,
    "frame.png": lambda path: read_image(path, "fetch it"),
    "scene.json": lambda path: read_json(path, "a scene", "fetch it"),
    "models_info.json": read_models_info,
    "mine.yaml": read_mapping,
    "pose.txt": read_pose,
    "data.zip": lambda path: unpack(path, path.parent / "unpacked"),
    "part.obj": lambda path: read_surface(path, 1.0),
    **{f"cloud.{suffix}": lambda path: read_points(path) for suffix in ("ply", "pcd", "obj", "stl", "off")},
}
everywhere = pytest.mark.parametrize("name", READERS)


@pytest.fixture
def folder():
    """A folder that any user can enter, which pytest's own are not."""
    with tempfile.TemporaryDirectory() as made:
        Path(made).chmod(0o755)
        yield Path(made)


@pytest.fixture
def unprivileged():
    """The rights of a user who is not root: root may read everything."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    yield
    os.seteuid(0)


@everywhere
def test_a_pipe_is_not_read(folder, name):
    os.mkfifo(folder / name)
    with pytest.raises(InputError, match=f"{name}: is a device, pipe or socket, not a file; "):
        READERS[name](folder / name)


@everywhere
def test_what_the_kernel_shows_as_an_empty_file_is_not_read(folder, name):
    (folder / name).symlink_to("/proc/version")  # that of /proc/kmsg never ends
    with pytest.raises(InputError, match=f"{name}: is empty; "):
        READERS[name](folder / name)


@everywhere
def test_a_missing_permission_is_not_taken_for_damage(folder, name, request):
    (folder / name).write_text("content")
    (folder / name).chmod(0)
    request.getfixturevalue("unprivileged")
    with pytest.raises(InputError, match=rf"{name}: cannot be read \(Permission denied\); "):
        READERS[name](folder / name)


@pytest.mark.parametrize("name", ["loop", "x" * 300, "a\0b"])
def test_a_name_that_leads_to_no_file_is_one_line(folder, name):
    (folder / "loop").symlink_to("loop")
    with pytest.raises(InputError, match="cannot be read"):
        require_file(folder / name, "no such file", "make it")
