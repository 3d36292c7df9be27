import io
import tarfile

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.point_files import from_entry, surfaces
from tests.objects.test_pcd import ascii_pcd


def view(depth):
    return ascii_pcd([f"0 {i / 100} {depth} 0 0 0" for i in range(3)])


def write_tar(path, members, mode="w"):
    with tarfile.open(path, mode) as archive:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    return path


@pytest.fixture
def mug_tar(tmp_path):
    """Instance 1: sequences 1, 2 and 4 of 20 frames each, in the order of names that no number keeps."""
    names = sorted(f"coffee_mug_1/coffee_mug_1_{sequence}_{frame}" for sequence in (1, 2, 4) for frame in range(1, 21))
    members = {f"{name}.pcd": view(int(name.split("_")[-1])) for name in names}
    return write_tar(tmp_path / "coffee_mug_1.tar", {**members, "coffee_mug_1/readme.txt": b"hello"})


def test_views_are_spread_evenly_over_sequences_and_frames(mug_tar):
    found = list(surfaces([mug_tar]))
    assert [surface.name for surface in found] == [
        f"coffee_mug_1_{sequence}_{frame}" for sequence in (1, 2, 4) for frame in (1, 11)
    ]
    assert found[1].vertices_m[:, 2].tolist() == [11, 11, 11]
    assert found[0].faces is None


def test_single_files_tars_and_instances_together(tmp_path, mug_tar):
    for name in ("apple_1_1_1", "apple_1_1_2", "apple_2_1_1", "loose"):
        (tmp_path / f"{name}.pcd").write_bytes(view(500))
    write_tar(tmp_path / "coffee_mug_2.tgz", {"./coffee_mug_2_1_1.pcd": view(700)}, "w:gz")
    found = list(from_entry({"views_per_instance": 1, "unit": "mm"}, tmp_path))
    names = ["apple_1_1_1", "apple_2_1_1", "loose", "coffee_mug_1_1_1", "coffee_mug_2_1_1"]
    assert [surface.name for surface in found] == names
    assert found[-1].vertices_m[:, 2] == pytest.approx(np.full(3, 0.7))
    assert len(list(from_entry({"views_per_instance": 1}, mug_tar))) == 1


def test_faults_name_the_tar_and_its_member(tmp_path):
    wrong = write_tar(tmp_path / "wrong.tar", {"a/mug_1_1_1.pcd": view(1).replace(b"FIELDS", b"FEILDS")})
    with pytest.raises(InputError, match=r"wrong\.tar, member a/mug_1_1_1\.pcd: .*FIELDS"):
        list(surfaces([wrong]))
    with pytest.raises(InputError, match=r"empty\.tar: the archive has no \.pcd"):
        list(surfaces([write_tar(tmp_path / "empty.tar", {"readme.txt": b""})]))


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.8])
def test_truncated_tar(mug_tar, kept):
    content = mug_tar.read_bytes()
    mug_tar.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=r"coffee_mug_1\.tar: is a truncated"):
        list(surfaces([mug_tar]))


def test_missing_and_empty_folder(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        list(from_entry({}, tmp_path / "nowhere"))
    with pytest.raises(InputError, match="has none of"):
        list(from_entry({}, tmp_path))
