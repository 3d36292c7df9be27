"""Archives that would fill the memory or leave their folder, through the command line."""

import gzip
import io
import json
import tarfile
import zipfile

import pytest

from gpca.errors import InputError
from gpca.objects import downloads
from gpca.objects.downloads import unpack

from ..hostile import refusal

VIEW = "mug_1_1_1.pcd"
GB = 10**9


def header(kind, size, name=VIEW):
    info = tarfile.TarInfo(name)
    info.type, info.size = kind, size
    return info.tobuf(tarfile.GNU_FORMAT)


def said_to_hold(path, kind, size):
    """A tar that says that it holds so much: a hole in an uncompressed one, and nothing in a compressed one."""
    if path.suffix == ".tgz":
        path.write_bytes(gzip.compress(header(kind, size) + bytes(10240)))
        return
    with path.open("wb") as file:
        file.write(header(kind, size))
        file.truncate(512 + -(-size // 512) * 512 + 1024)


def zipped(path, method=zipfile.ZIP_DEFLATED, content=b"x"):
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr(VIEW, content)


def with_member(path, name, kind=tarfile.REGTYPE):
    info = tarfile.TarInfo(name)
    info.type, info.size, info.linkname = kind, 1 if kind == tarfile.REGTYPE else 0, "/etc/passwd"
    with tarfile.open(path, "w") as file:
        file.addfile(info, io.BytesIO(b"x"))


LONG = {"pax header": tarfile.XHDTYPE, "global header": tarfile.XGLTYPE, "long name": tarfile.GNUTYPE_LONGNAME}
LONG |= {"long link": tarfile.GNUTYPE_LONGLINK, "header of Solaris": tarfile.SOLARIS_XHDTYPE}
ARCHIVES = {
    **{f"{name}.tar": lambda path, kind=kind: said_to_hold(path, kind, 3 * GB) for name, kind in LONG.items()},
    "long name.tgz": lambda path: said_to_hold(path, tarfile.GNUTYPE_LONGNAME, 3 * GB),
    "member.tar": lambda path: said_to_hold(path, tarfile.REGTYPE, 3 * GB),
    "members.tar": lambda path: said_to_hold(path, tarfile.REGTYPE, 30 * GB),
    "bytes missing.tgz": lambda path: said_to_hold(path, tarfile.REGTYPE, 3 * GB),
    "link.tar": lambda path: with_member(path, VIEW, tarfile.SYMTYPE),
    "no cloud.tar": lambda path: with_member(path, "mug.txt"),
    "damaged cloud.tar": lambda path: with_member(path, VIEW),
}


@pytest.mark.parametrize("name", ARCHIVES)
def test_an_archive_of_views_is_refused(name, tmp_path):
    ARCHIVES[name](tmp_path / name)
    settings = json.dumps({"kind": "uw_rgbd", "location": ".", "unit": "m"})
    command = ["objects", "--source", "s", "--data-dir", ".", "--out", "new.npz", "--settings", settings]
    refusal(command, tmp_path, name)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_compression_that_cannot_be_read_piece_by_piece_is_refused(method, tmp_path):
    zipped(tmp_path / "a.zip", method, bytes(10**6))
    with pytest.raises(InputError, match=r"a\.zip: member 'mug_1_1_1\.pcd' is compressed by a method other"):
        unpack(tmp_path / "a.zip", tmp_path / "target")


def test_a_disk_that_is_too_small_is_named_before_anything_is_written(tmp_path, monkeypatch):
    zipped(tmp_path / "a.zip", content=bytes(5 * 10**6))
    monkeypatch.setattr(downloads.shutil, "disk_usage", lambda folder: type("Usage", (), {"free": 10**6}))
    with pytest.raises(InputError, match=r"a\.zip: unpacks to 0\.005 GB, but 0\.001 GB of the disk are free"):
        unpack(tmp_path / "a.zip", tmp_path / "target")
    assert [path.name for path in tmp_path.iterdir()] == ["a.zip"]
