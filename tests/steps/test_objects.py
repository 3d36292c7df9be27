"""The step ``objects`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import refused, settings, truncated, untouched

FAULTS = [
    (untouched, settings("objects", location="nowhere"), r"'mesh_folder': nowhere does not exist; correct"),
    (untouched, {"--data-dir": "nowhere"}, r"nowhere: no such folder"),
    (lambda folder: (folder / "empty").mkdir(), settings("objects", location="empty"), r"the folder has none of"),
    (truncated("meshes/cone.ply"), {}, r"cone.ply: is truncated or not a readable .ply file"),
    (untouched, settings("objects", unit="m"), r"object 'brick': its diameter is 128.5 m, so the declared unit"),
    (untouched, {"--out": "meshes/brick.stl/objects.npz"}, r"meshes/brick.stl"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "objects", *FAULTS[fault])
