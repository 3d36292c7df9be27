import hashlib
import socket

import pytest

from gpca.errors import InputError
from gpca.objects import downloads
from gpca.objects.downloads import cached_path, fetch

CONTENT = b"some archive" * 1000
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture
def url(server):
    (server.folder / "data").mkdir()
    (server.folder / "data" / "models.zip").write_bytes(CONTENT)
    return f"{server.url}/data/models.zip"


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file()]


def test_fetches_once(url, server, tmp_path):
    path = fetch(url, SHA256, tmp_path)
    assert path == tmp_path / "127.0.0.1" / "data" / "models.zip"
    assert path.read_bytes() == CONTENT
    assert fetch(url, SHA256.upper(), tmp_path) == path
    assert len(server.requests) == 1
    assert files(tmp_path) == [path]


def test_unpinned_checksum_is_printed(url, tmp_path, capsys):
    fetch(url, None, tmp_path)
    output = capsys.readouterr()
    assert SHA256 in output.err
    assert output.out == ""


def test_wrong_checksum_removes_the_download(url, tmp_path):
    with pytest.raises(InputError, match=f"{url}: .*expected sha256 {'0' * 64}, got {SHA256}"):
        fetch(url, "0" * 64, tmp_path)
    assert files(tmp_path) == []


def test_wrong_checksum_keeps_a_file_that_was_there(url, server, tmp_path):
    path = fetch(url, None, tmp_path)
    with pytest.raises(InputError, match=f"expected sha256 {'0' * 64}, got {SHA256}; delete {path}"):
        fetch(url, "0" * 64, tmp_path)
    assert path.read_bytes() == CONTENT


def test_no_network(tmp_path, monkeypatch):
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    with socket.socket() as closed:  # bound but not listening: refuses every connection
        closed.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{closed.getsockname()[1]}/lm_models.zip"
        with pytest.raises(InputError) as caught:
            fetch(url, None, tmp_path, location="bop/lm")
    by_hand = tmp_path / "127.0.0.1" / "lm_models.zip"
    assert str(caught.value) == (
        f"{url}: cannot be reached; set data_dir to a folder that contains bop/lm, or download it by hand to {by_hand}"
    )
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


@pytest.mark.parametrize("name", ["drip.zip", "drip-head.zip"])
def test_a_server_that_sends_a_byte_now_and_then_is_left(server, tmp_path, monkeypatch, name):
    monkeypatch.setattr(downloads, "GRACE_S", 0)
    monkeypatch.setattr(downloads, "SLOWEST_BYTES_PER_S", 10**6)
    with pytest.raises(InputError, match=rf"{name}: sent \d+ bytes in \d+ s, which is too slow; set data_dir"):
        fetch(f"{server.url}/{name}", None, tmp_path)
    assert files(tmp_path) == []


def test_a_download_that_is_larger_than_any_is_stopped(server, url, tmp_path, monkeypatch):
    monkeypatch.setattr(downloads, "LARGEST_DOWNLOAD_BYTES", len(CONTENT) - 1)
    with pytest.raises(InputError, match=r"models\.zip: sends more than 11999 bytes"):
        fetch(url, None, tmp_path)
    assert files(tmp_path) == []


def test_each_url_has_a_file_of_its_own_within_the_cache(tmp_path):
    urls = [
        "https://a.org/x/m.zip",
        "https://b.org/x/m.zip",
        "https://a.org/m.zip",
        "https://a.org/m.zip?v=1",
        "https://a.org/m.zip?v=/2",
    ]
    assert len({cached_path(url, tmp_path) for url in urls}) == len(urls)
    assert cached_path("https://a.org/../../../m.zip", tmp_path) == tmp_path / "a.org" / "m.zip"


@pytest.mark.parametrize(
    "url", ["ftp://a.org/m.zip", "file:///etc/passwd", "a.org/m.zip", "https://a.org/", "", "http:///m.zip"]
)
def test_no_file_address(url, tmp_path):
    with pytest.raises(InputError, match="http or https"):
        fetch(url, None, tmp_path)
