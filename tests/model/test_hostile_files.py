"""Model files that are damaged, or no such files, through ``explain``."""

import zipfile

import numpy as np
import pytest
import torch

from gpca.errors import InputError
from gpca.model.file import Model

from ..hostile import refusal
from .spoiled import EXPLAIN


def members(path, change):
    """Write the zip anew, each member as `change` gives it: name, content and compression."""
    with zipfile.ZipFile(path) as archive:
        found = [(info.filename, archive.read(info)) for info in archive.infolist()]
    with zipfile.ZipFile(path, "w", compresslevel=1) as archive:
        for name, content in found:
            for new_name, new_content, compression in change(name, content):
                archive.writestr(new_name, new_content, compression)


def is_data(name):
    return name.endswith("/data/0")


FILES = {
    "nothing": lambda path: path.write_bytes(b""),
    "half of it": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "text": lambda path: path.write_text("version https://git-lfs.github.com/spec/v1\n"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "a device": lambda path: (path.unlink(), path.symlink_to("/dev/zero")),
    "code": lambda path: torch.save(print, path),
    "an old pickle": lambda path: torch.save({"format": "GP-CA model"}, path, _use_new_zipfile_serialization=False),
    "a compressed bomb": lambda path: members(
        path,
        lambda name, content: [(name, bytes(600 << 20) if is_data(name) else content, zipfile.ZIP_DEFLATED)],
    ),
    "a member that is gone": lambda path: members(
        path, lambda name, content: [] if is_data(name) else [(name, content, zipfile.ZIP_STORED)]
    ),
    "a member that is too short": lambda path: members(
        path, lambda name, content: [(name, content[:8] if is_data(name) else content, zipfile.ZIP_STORED)]
    ),
}


@pytest.mark.parametrize("fault", FILES)
def test_a_file_that_is_no_model_is_refused(fault, folder):
    FILES[fault](folder / "model.pt")
    refusal(EXPLAIN, folder, "model.pt", "make one with")


def flip(content, position):
    changed = bytearray(content)
    changed[position] ^= 1 << (position % 8)
    return bytes(changed)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_a_flipped_bit_in_the_data_is_found(share, folder):
    path = folder / "model.pt"
    with zipfile.ZipFile(path) as archive:
        tensors = [info for info in archive.infolist() if "/data/" in info.filename]
        info = max(tensors, key=lambda info: info.file_size)
        content = archive.read(info)
    start = path.read_bytes().index(content)
    path.write_bytes(flip(path.read_bytes(), start + int(share * len(content))))
    refusal(EXPLAIN, folder, "model.pt", "checksum")


def tensors_of(model):
    kernel = model.gpc.state()["kernel"]
    return [
        *model.encoder.state_dict().values(),
        *kernel.values(),
        *map(torch.as_tensor, vars(model.gpc._latents).values()),
    ]


def test_a_flipped_bit_anywhere_is_found_or_harmless(saved, tmp_path):
    """Data, headers, padding, directory: 400 places, drawn anew nowhere."""
    content, expected = saved.read_bytes(), Model.load(saved)
    path = tmp_path / "model.pt"
    found = 0
    for position in np.random.default_rng(0).integers(len(content), size=400):
        path.write_bytes(flip(content, int(position)))
        try:
            loaded = Model.load(path)
        except InputError:
            found += 1
            continue
        assert all(map(torch.equal, tensors_of(loaded), tensors_of(expected)))
        for name in ("encoder_settings", "icp", "cloud_points", "policy", "title", "stand_in", "concepts"):
            assert getattr(loaded, name) == getattr(expected, name)
    assert found > 200
