"""Files of laser scanners: their packages are not installed here, so stand-ins answer as these do."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.point_files import CARTESIAN, read_scanner_file

POINTS = np.arange(12.0).reshape(4, 3)


class E57:
    """As pye57 0.4 is used: scans by their number, in the frame of the file."""

    scan_count = 2

    def __init__(self, path):
        assert isinstance(path, str)

    def read_scan(self, number, ignore_missing_fields):
        assert ignore_missing_fields
        return dict(zip(CARTESIAN, POINTS[2 * number : 2 * number + 2].T, strict=True))

    def close(self):
        pass


def las(path):
    return SimpleNamespace(xyz=POINTS)


def cut(path):
    raise ValueError("No LazBackend selected, cannot decompress data")


@pytest.mark.parametrize(
    ("name", "package", "module"),
    [("scan.las", "laspy", SimpleNamespace(read=las)), ("scan.e57", "pye57", SimpleNamespace(E57=E57))],
)
def test_points_come_from_the_package_of_the_format(tmp_path, monkeypatch, name, package, module):
    (tmp_path / name).write_bytes(b"scan")
    monkeypatch.setitem(sys.modules, package, module)
    np.testing.assert_array_equal(read_scanner_file(tmp_path / name), POINTS)


@pytest.mark.parametrize(("name", "package"), [("scan.laz", "laspy"), ("scan.e57", "pye57")])
def test_a_missing_package_is_named_with_the_command_that_installs_it(tmp_path, monkeypatch, name, package):
    (tmp_path / name).write_bytes(b"scan")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"needs the package {package}, which is not installed; pip install"):
        read_scanner_file(tmp_path / name)


def test_what_the_package_cannot_read_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "scan.laz").write_bytes(b"scan")
    monkeypatch.setitem(sys.modules, "laspy", SimpleNamespace(read=cut))
    with pytest.raises(InputError, match=r"cannot be read \(No LazBackend .*; pip install 'laspy\[lazrs\]'"):
        read_scanner_file(tmp_path / "scan.laz")
