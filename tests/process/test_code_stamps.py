import os

import pytest

from gpca.process import code_files as files_of_code
from gpca.process.code_files import code_stamp


@pytest.fixture
def stamp(tmp_path, monkeypatch):
    """A function that returns the stamp of a project's module as a new process does, with one imported module."""
    (tmp_path / "gpca").mkdir()
    (tmp_path / "gpca/step.py").write_text("import gpca.used\n")
    for name in ("used", "unused"):
        (tmp_path / f"gpca/{name}.py").write_text("")
    monkeypatch.setattr(files_of_code, "ROOT", tmp_path)
    monkeypatch.chdir(tmp_path)

    def forget():
        for cached in (files_of_code._imports, files_of_code._file, files_of_code._sha256, code_stamp):
            cached.cache_clear()

    def fresh(*modules):
        forget()
        return tmp_path / code_stamp(*modules)

    yield fresh
    forget()


def test_a_stamp_changes_with_the_code_that_is_imported_and_with_nothing_else(stamp, tmp_path):
    path = stamp("gpca.step")
    before = path.read_bytes(), path.stat().st_mtime_ns
    assert [line.split()[1] for line in path.read_text().splitlines()] == ["gpca/step.py", "gpca/used.py"]
    (tmp_path / "gpca/unused.py").write_text("1\n")
    (tmp_path / "gpca/used.py").touch()
    assert stamp("gpca.step") == path
    assert (path.read_bytes(), path.stat().st_mtime_ns) == before
    (tmp_path / "gpca/used.py").write_text("1\n")
    os.utime(tmp_path / "gpca/used.py", (0, 0))  # as copied from elsewhere
    assert stamp("gpca.step") == path
    assert path.read_bytes() != before[0]
    assert path.stat().st_mtime_ns > before[1]
    assert stamp("gpca.step", "gpca.unused") != path


def test_a_first_stamp_is_as_old_as_the_newest_file(stamp, tmp_path):
    for name, seconds in (("step", 1000), ("used", 2000), ("unused", 3000)):
        os.utime(tmp_path / f"gpca/{name}.py", (seconds, seconds))
    assert stamp("gpca.step").stat().st_mtime == 2000
