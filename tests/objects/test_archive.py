import io
import os
import shutil
import tarfile
import zipfile

import pytest

from gpca.errors import InputError
from gpca.objects.downloads import unpack

FILES = {"models/obj_000001.ply": os.urandom(5000), "models/deep/er/info.json": b"{}", "top.txt": b"t"}


def pack(path, files=FILES, extra=()):
    """Zip, tar or tgz by the suffix; `extra` are TarInfo or ZipInfo objects without content."""
    if path.suffix == ".zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("models/", "")
            for name, content in files.items():
                archive.writestr(name, content)
            for info in extra:
                archive.writestr(info, "target")
        return path
    with tarfile.open(path, "w:gz" if path.suffix == ".tgz" else "w") as archive:
        folder = tarfile.TarInfo("./models")
        folder.type = tarfile.DIRTYPE
        archive.addfile(folder)
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
        for info in extra:
            archive.addfile(info)
    return path


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def nothing_left(tmp_path, archive):
    return [path for path in tmp_path.rglob("*") if path != archive] == []


FORMATS = pytest.mark.parametrize("suffix", ["zip", "tar", "tgz"])


@FORMATS
def test_unpacks(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}")
    assert unpack(archive, tmp_path / "new" / "target") == tmp_path / "new" / "target"
    assert contents(tmp_path / "new/target") == FILES


def change(folder):
    (folder / "top.txt").write_bytes(b"u")  # as long as before


def lengthen(folder):
    (folder / "models/deep/er/info.json").write_bytes(b"{} ")


def lose(folder):
    (folder / "models/obj_000001.ply").unlink()


def add(folder):
    (folder / "models/obj_000002.ply").write_bytes(b"ply")


CHANGES = {change: "top.txt: was changed", lengthen: "info.json: was changed"}
CHANGES |= {lose: "obj_000001.ply: is missing", add: "obj_000002.ply: is not from the archive"}


@FORMATS
def test_a_folder_that_was_unpacked_is_checked_and_kept(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}")
    folder = unpack(archive, tmp_path / "target")
    (folder / ".DS_Store").write_bytes(b"what a desktop leaves")
    before = (folder / "top.txt").stat().st_mtime_ns
    assert unpack(archive, folder) == folder
    assert (folder / "top.txt").stat().st_mtime_ns == before


@FORMATS
@pytest.mark.parametrize("change", CHANGES)
def test_a_folder_that_was_changed_since_is_refused(tmp_path, suffix, change):
    archive = pack(tmp_path / f"a.{suffix}")
    folder = unpack(archive, tmp_path / "target")
    change(folder)
    with pytest.raises(InputError, match=f"{CHANGES[change]}.*; remove {folder} and target.sha256.json"):
        unpack(archive, folder)
    for path in (folder, tmp_path / "target.sha256.json"):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert contents(unpack(archive, folder)) == FILES


def test_a_folder_without_a_list_is_unpacked_again(tmp_path):
    archive = pack(tmp_path / "a.zip")
    folder = unpack(archive, tmp_path / "target")
    change(folder)
    (tmp_path / "target.sha256.json").unlink()
    assert contents(unpack(archive, folder)) == FILES


@pytest.mark.parametrize("text", [" ", "{", "[1, 2]", "null"])
def test_a_list_that_is_damaged_is_refused(tmp_path, text):
    archive = pack(tmp_path / "a.zip")
    folder = unpack(archive, tmp_path / "target")
    (tmp_path / "target.sha256.json").write_text(text)
    with pytest.raises(InputError, match=r"target\.sha256\.json: is not a list of files .*; remove"):
        unpack(archive, folder)


@FORMATS
@pytest.mark.parametrize(
    "name", ["../evil", "models/../../evil", "/tmp/evil", "..\\evil", "C:\\evil", "\\\\host\\evil"]
)
def test_path_that_leaves_the_folder(tmp_path, suffix, name):
    archive = pack(tmp_path / f"a.{suffix}", {**FILES, name: b"evil"})
    with pytest.raises(InputError, match=rf"a\.{suffix}: member .*evil' would leave"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE])
def test_links_and_devices_in_a_tar(tmp_path, kind):
    info = tarfile.TarInfo("models/link")
    info.type, info.linkname = kind, "top.txt"
    archive = pack(tmp_path / "a.tar", extra=[info])
    with pytest.raises(InputError, match="'models/link' is a link"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


def test_link_in_a_zip(tmp_path):
    info = zipfile.ZipInfo("link")
    info.create_system, info.external_attr = 3, 0o120777 << 16
    archive = pack(tmp_path / "a.zip", extra=[info])
    with pytest.raises(InputError, match="'link' is a link"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


@FORMATS
@pytest.mark.parametrize("kept", [0.0, 0.1, 0.6, 0.95])
def test_truncated(tmp_path, suffix, kept):
    archive = pack(tmp_path / f"a.{suffix}", {**FILES, "last.bin": os.urandom(30000)})
    content = archive.read_bytes()
    archive.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=rf"a\.{suffix}: is {'a truncated' if kept else 'empty'}"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


def test_tar_cut_between_two_members(tmp_path):
    archive = pack(tmp_path / "a.tar", {"a": b"1" * 512, "b": b"2" * 512})
    archive.write_bytes(archive.read_bytes()[: 512 + 1024])  # the folder and a; b and the end mark are lost
    with pytest.raises(InputError, match="truncated"):
        unpack(archive, tmp_path / "target")


@pytest.mark.parametrize("suffix", ["zip", "tgz"])
def test_damaged_content(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}")
    content = bytearray(archive.read_bytes())
    content[2000] ^= 0xFF
    archive.write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


@FORMATS
def test_bomb(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}", {"zeros": bytes(2_000_000)})
    with pytest.raises(InputError, match=r"more than 0\.001 GB"):
        unpack(archive, tmp_path / "target", largest_bytes=10**6)
    assert nothing_left(tmp_path, archive)


def test_file_that_is_also_a_folder(tmp_path):
    archive = pack(tmp_path / "a.tar", {"a": b"1", "a/b": b"2"})
    with pytest.raises(InputError, match="both a file and a folder"):
        unpack(archive, tmp_path / "target")
    assert nothing_left(tmp_path, archive)


def test_no_archive(tmp_path):
    (tmp_path / "page.zip").write_text("<html>please log in</html>" * 100)
    with pytest.raises(InputError, match=r"page\.zip"):
        unpack(tmp_path / "page.zip", tmp_path / "target")
    with pytest.raises(InputError, match="no such file"):
        unpack(tmp_path / "none.zip", tmp_path / "target")
