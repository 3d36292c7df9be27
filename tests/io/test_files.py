import os
import subprocess
import sys
from pathlib import Path

import pytest

from gpca.io.files import whole_file, whole_folder

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
