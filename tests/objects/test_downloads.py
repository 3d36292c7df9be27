"""Downloads, and archives that would fill the disk or leave their folder."""

import hashlib
import io
import os
import socket
import tarfile
import zipfile

import pytest

from gpca.errors import InputError
from gpca.objects import downloads
from gpca.objects.downloads import cached_path, fetch, unpack

CONTENT = b"some archive" * 1000
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture
def url(server):
    (server.folder / "data").mkdir()
    (server.folder / "data" / "models.zip").write_bytes(CONTENT)
    return f"{server.url}/data/models.zip"


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file()]


def test_fetches_once(url, server, tmp_path, capsys):
    path = fetch(url, SHA256, tmp_path)
    assert path == tmp_path / "127.0.0.1" / "data" / "models.zip"
    assert path.read_bytes() == CONTENT
    assert fetch(url, SHA256.upper(), tmp_path) == path
    assert len(server.requests) == 1
    assert files(tmp_path) == [path]
    with pytest.raises(InputError, match=f"expected sha256 {'0' * 64}, got {SHA256}; delete {path}"):
        fetch(url, "0" * 64, tmp_path)
    assert path.read_bytes() == CONTENT
    path.unlink()  # what was downloaded is removed again
    with pytest.raises(InputError, match=f"{url}: .*expected sha256 {'0' * 64}, got {SHA256}"):
        fetch(url, "0" * 64, tmp_path)
    assert files(tmp_path) == [] and SHA256 not in capsys.readouterr().err
    fetch(url, None, tmp_path)  # without a checksum, it is printed
    output = capsys.readouterr()
    assert SHA256 in output.err and output.out == ""


def test_no_network(tmp_path, monkeypatch):
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    with socket.socket() as closed:  # bound but not listening: refuses every connection
        closed.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{closed.getsockname()[1]}/lm_models.zip"
        with pytest.raises(InputError) as caught:
            fetch(url, None, tmp_path, location="bop/lm")
    by_hand = tmp_path / "127.0.0.1" / "lm_models.zip"
    remedy = f"; set data_dir to a folder that contains bop/lm, or download it by hand to {by_hand}"
    assert str(caught.value).startswith(f"{url}: cannot be fetched: ConnectionError(")
    assert str(caught.value).endswith(remedy)
    assert files(tmp_path) == []


def test_file_fetched_by_hand_needs_no_network(tmp_path):
    url = "http://127.0.0.1:9/data/models.zip"
    path = cached_path(url, tmp_path)
    path.parent.mkdir(parents=True)
    path.write_bytes(CONTENT)
    assert fetch(url, SHA256, tmp_path) == path


def test_error_answer_and_interrupted_transfer(server, tmp_path):
    with pytest.raises(InputError, match=r"none\.zip: .*the server answered 404"):
        fetch(f"{server.url}/none.zip", None, tmp_path)
    with pytest.raises(InputError, match=r"short\.zip: "):
        fetch(f"{server.url}/short.zip", None, tmp_path)
    assert files(tmp_path) == []


def test_each_url_has_a_file_of_its_own_within_the_cache(tmp_path):
    urls = ["https://a.org/x/m.zip", "https://b.org/x/m.zip", "https://a.org/m.zip"]
    urls += ["https://a.org/m.zip?v=1", "https://a.org/m.zip?v=/2"]
    assert len({cached_path(url, tmp_path) for url in urls}) == len(urls)
    assert cached_path("https://a.org/../../../m.zip", tmp_path) == tmp_path / "a.org" / "m.zip"


@pytest.mark.parametrize(
    "url", ["ftp://a.org/m.zip", "file:///etc/passwd", "a.org/m.zip", "https://a.org/", "", "http:///m.zip"]
)
def test_no_file_address(url, tmp_path):
    with pytest.raises(InputError, match="http or https"):
        fetch(url, None, tmp_path)


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


FORMATS = pytest.mark.parametrize("suffix", ["zip", "tar", "tgz"])


@FORMATS
def test_unpacks(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}")
    folder = tmp_path / "new/target"
    assert unpack(archive, folder) == folder
    assert {str(path.relative_to(folder)): path.read_bytes() for path in files(folder)} == FILES


@FORMATS
@pytest.mark.parametrize("name", ["../evil", "models/../../evil", "/tmp/evil"])
def test_nothing_leaves_the_folder(tmp_path, suffix, name):
    archive = pack(tmp_path / f"a.{suffix}", {**FILES, name: b"evil"})
    try:
        unpack(archive, tmp_path / "target")
    except InputError as fault:
        assert "damaged archive" in str(fault)
    evil = [path for path in tmp_path.rglob("evil") if path.is_relative_to(tmp_path / "target")]
    assert [path for path in (*tmp_path.parent.glob("evil"), *tmp_path.rglob("evil")) if path not in evil] == []


def refused(archive, message):
    with pytest.raises(InputError, match=message):
        unpack(archive, archive.parent / "target")
    assert [path for path in archive.parent.rglob("*") if path != archive] == []


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE])
def test_links_out_and_devices(tmp_path, kind):
    info = tarfile.TarInfo("link")
    info.type, info.linkname = kind, "../../etc/passwd"
    refused(pack(tmp_path / "a.tar", extra=[info]), "or holds links or devices")


def test_damaged_archives(tmp_path):
    for suffix in ("zip", "tgz"):
        archive = pack(tmp_path / f"a.{suffix}")
        content = bytearray(archive.read_bytes())
        content[2000] ^= 0xFF
        archive.write_bytes(content)
        refused(archive, "damaged")
        archive.unlink()
    both = pack(tmp_path / "a.tar", {"a": b"1", "a/b": b"2"})  # a file that is also a folder
    refused(both, r"a\.tar: is a truncated or damaged archive")


@FORMATS
@pytest.mark.parametrize("kept", [0.0, 0.1, 0.6, 0.95])
def test_truncated(tmp_path, suffix, kept):
    archive = pack(tmp_path / f"a.{suffix}", {**FILES, "last.bin": os.urandom(30000)})
    content = archive.read_bytes()
    archive.write_bytes(content[: int(kept * len(content))])
    refused(archive, rf"a\.{suffix}: is {'a truncated' if kept else 'empty'}")


@FORMATS
def test_bomb(tmp_path, suffix):
    archive = pack(tmp_path / f"a.{suffix}", {"zeros": bytes(2_000_000)})
    with pytest.raises(InputError, match=r"more than 0\.001 GB"):
        unpack(archive, tmp_path / "target", largest_bytes=10**6)
    assert files(tmp_path) == [archive]


def test_no_archive(tmp_path):
    (tmp_path / "page.zip").write_text("<html>please log in</html>" * 100)
    with pytest.raises(InputError, match=r"page\.zip"):
        unpack(tmp_path / "page.zip", tmp_path / "target")
    with pytest.raises(InputError, match="no such file"):
        unpack(tmp_path / "none.zip", tmp_path / "target")


def test_a_disk_that_is_too_small_is_named_before_anything_is_written(tmp_path, monkeypatch):
    pack(tmp_path / "a.zip", {"mug.pcd": bytes(5 * 10**6)})
    monkeypatch.setattr(downloads.shutil, "disk_usage", lambda folder: type("Usage", (), {"free": 10**6}))
    with pytest.raises(InputError, match=r"a\.zip: unpacks to 0\.005 GB, but 0\.001 GB of the disk are free"):
        unpack(tmp_path / "a.zip", tmp_path / "target")
    assert [path.name for path in tmp_path.iterdir()] == ["a.zip"]
