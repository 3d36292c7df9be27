"""Files of an earlier step that are no arrays, or not whole; and whole ones."""

import io
import zipfile

import numpy as np
import pytest

from ...hostile import refusal
from ..by_words import main
from .commands import COMMANDS


def header(shape, descr="'<f4'", version=b"\x01\x00"):
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    length = len(text).to_bytes(2 if version[0] == 1 else 4, "little")
    return b"\x93NUMPY" + version + length + text


def rewritten(path, name, content, compression=zipfile.ZIP_DEFLATED):
    """Put other bytes, or a function that writes them, in the place of one array."""
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    members.pop(f"{name}.npy")
    with zipfile.ZipFile(path, "w", compression, compresslevel=1) as archive:
        for filename, kept in members.items():
            archive.writestr(filename, kept)
        with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
            content(stream) if callable(content) else stream.write(content)


def zeros(head, size):
    def write(stream):
        stream.write(head)
        piece = bytes(1 << 20)
        for _ in range(size >> 20):
            stream.write(piece)

    return write


def bomb(path, name):
    with np.load(path) as archive:
        shape = archive[name].shape
    rows = (600 << 20) // int(4 * np.prod(shape[1:]))
    rewritten(path, name, zeros(header((rows, *shape[1:])), rows * int(4 * np.prod(shape[1:]))))


def unread_bomb(path, name):
    """An array that no one asks for, and an asked one that is not there."""
    rewritten(path, name, b"")
    archive = zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1)
    with archive, archive.open("other.npy", "w") as stream:
        zeros(header((1 << 28,)), 1 << 30)(stream)


def twice(path, name):
    with np.load(path) as archive:
        content = io.BytesIO()
        np.save(content, archive[name])
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr(f"{name}.npy", content.getvalue())


def flipped(path, name):
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        info = archive.getinfo(f"{name}.npy")
    content[info.header_offset + 128 + info.file_size // 2] ^= 1
    path.write_bytes(content)


FILES = {
    "a bomb": bomb,
    "a bomb that nobody asks for": unread_bomb,
    "a header of gigabytes": lambda path, name: rewritten(
        path, name, zeros(b"\x93NUMPY\x02\x00" + (2**31).to_bytes(4, "little"), 600 << 20)
    ),
    "more rows than data": lambda path, name: rewritten(path, name, header((10**15, 3))),
    "negative rows": lambda path, name: rewritten(path, name, header((-1, 3))),
    "rows of no number": lambda path, name: rewritten(path, name, header(("'many'", 3))),
    "a header that is no header": lambda path, name: rewritten(path, name, header("__import__('os').getpid()")),
    "pickled objects": lambda path, name: rewritten(path, name, header((1,), "'|O'") + b"cos\ngetpid\n(tR."),
    "records": lambda path, name: rewritten(path, name, header((1,), "[('x', '<f4')]") + bytes(4)),
    "an unknown version": lambda path, name: rewritten(path, name, header((1,), version=b"\x09\x00")),
    "more data than rows": lambda path, name: rewritten(path, name, header((1, 3)) + bytes(5000)),
    "bzip2": lambda path, name: rewritten(path, name, header((4, 3)) + bytes(48), zipfile.ZIP_BZIP2),
    "an array twice": twice,
    "a flipped bit": flipped,
    "a folder": lambda path, name: (path.unlink(), path.mkdir()),
    "a device": lambda path, name: (path.unlink(), path.symlink_to("/dev/zero")),
}


@pytest.mark.parametrize("fault", FILES)
def test_files_that_are_no_arrays_are_refused(fault, folder):
    """All files of arrays have the same reader."""
    FILES[fault](folder / "objects.npz", "points_m")
    refusal(COMMANDS["objects.npz"], folder, "objects.npz", " it with ")


@pytest.mark.parametrize("name", ["embeddings.npz", "objects.npz"])
def test_the_same_files_unspoilt_are_read(name, folder, monkeypatch):
    """Compressed as well, and with arrays of a user's own."""
    with np.load(folder / name) as archive:
        np.savez_compressed(folder / name, **archive, own=np.arange(3))
    monkeypatch.chdir(folder)
    for variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(variable, "1")
    settings = ["--settings", '{"train": 9, "test": 3, "cloud_points": 64}'] if name == "objects.npz" else []
    assert main([*map(str, COMMANDS[name]), *settings]) == 0
    assert (folder / "new.npz").is_file()
