import hashlib
import io
import json
import subprocess
import sys
import tarfile
import zipfile

import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects.entry import stand_in_clause
from gpca.objects.source import data_files, data_folders, resolve, surfaces
from tests.objects.test_point_files import ascii_pcd

BOP = {"title": "Toy", "kind": "bop", "location": "bop/toy", "url": "https://example.org/toy_models.zip"}
CUPS = {
    "title": "Cups",
    "kind": "uw_rgbd",
    "unit": "m",
    "urls": ["https://example.org/mug_1.tar", "https://example.org/mug_2.tar"],
}
BOX = trimesh.creation.box((30.0, 40.0, 120.0))


def write_bop(folder):
    (folder / "models").mkdir(parents=True)
    BOX.export(folder / "models" / "obj_000001.ply")
    info = {"1": {"diameter": float(np.linalg.norm(BOX.extents))}}
    (folder / "models" / "models_info.json").write_text(json.dumps(info))


def write_cups(data_dir, folders=("cups", "more")):
    for folder in folders:
        (data_dir / folder).mkdir()
        BOX.copy().apply_scale(0.001).export(data_dir / folder / f"cup_{folder[0]}.ply")


def test_a_local_folder_comes_before_the_url_but_is_not_looked_up_in_the_working_folder(tmp_path, monkeypatch):
    assert resolve(BOP, None) == {**BOP, "origin": "download"}
    assert resolve(BOP, str(tmp_path))["origin"] == "download"
    write_bop(tmp_path / "bop" / "toy")
    expected = {**BOP, "origin": "local", "location": str(tmp_path / "bop" / "toy")}
    assert resolve(BOP, str(tmp_path)) == expected
    assert resolve({**BOP, "location": str(tmp_path / "bop" / "toy")}, None)["origin"] == "local"
    assert [surface.name for surface in surfaces(expected, tmp_path / "cache")] == ["obj_000001"]
    monkeypatch.chdir(tmp_path)
    assert resolve(BOP, None)["origin"] == "download"
    assert resolve(BOP, ".")["location"] == str(tmp_path / "bop" / "toy")


def test_a_folder_counts_when_it_has_all_files(tmp_path):
    entry = CUPS | {"kind": "mesh_folder", "files": ["cups/*.ply", "more/cup_?.ply"]}
    write_cups(tmp_path, ["cups"])
    assert resolve(entry, str(tmp_path))["origin"] == "download"
    write_cups(tmp_path, ["more"])
    resolved = resolve(entry, str(tmp_path))
    assert resolved["origin"] == "local"
    assert [surface.name for surface in surfaces(resolved, tmp_path)] == ["cup_c", "cup_m"]


def test_a_procedural_source_laid_over_one_of_files_needs_none_of_its_keys():
    entry = {"title": "Toy", "kind": "procedural", "family": "ycb"}
    assert resolve({**BOP, **CUPS, **entry, "location": "."}, None) == {**entry, "origin": "procedural"}


def test_empty_folder_is_a_fault_and_no_download(tmp_path):
    (tmp_path / "bop" / "toy").mkdir(parents=True)
    resolved = resolve(BOP, str(tmp_path))
    assert resolved["origin"] == "local"
    with pytest.raises(InputError, match="has no models"):
        list(surfaces(resolved, tmp_path))


@pytest.mark.parametrize("kind", ["bob", "archive", "canonical", "../bop", "shapes.ycb", "", None])
def test_unknown_kind(kind):
    with pytest.raises(InputError, match=r"is not a kind of source; choose one of procedural, bop, .*, uw_rgbd"):
        resolve({**BOP, "kind": kind}, None)


FAULTS = {
    "no family": ({"kind": "procedural", "title": "Toy"}, "'Toy': names no family"),
    "no url": ({"kind": "bop", "title": "Toy", "location": "bop/toy"}, "'Toy': bop/toy does not exist; .*data_dir"),
    "no place": ({"kind": "bop", "title": "Toy"}, "location does not exist"),
    "checksums": ({**BOP, "sha256": ["a", "b"]}, r"has 1 url\(s\) but 2 sha256"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_an_entry(fault, tmp_path):
    entry, message = FAULTS[fault]
    with pytest.raises(InputError, match=message):
        resolve(entry, str(tmp_path))


def test_resolving_is_light():
    code = (
        "import sys; from gpca.objects.source import resolve;"
        "resolve({'kind': 'bop', 'url': 'https://a.org/b.zip'}, None);"
        "print(sorted({'trimesh', 'open3d', 'torch', 'scipy', 'pooch', 'pandas'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_downloaded_zip_of_models(server, tmp_path):
    write_bop(tmp_path / "made")
    path = server.folder / "toy_models.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for file in (tmp_path / "made").rglob("*.*"):
            archive.write(file, file.relative_to(tmp_path / "made"))
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    entry = resolve({**BOP, "url": f"{server.url}/toy_models.zip", "sha256": sha256}, None)
    for _ in range(2):
        found = list(surfaces(entry, tmp_path / "cache"))
        assert [surface.name for surface in found] == ["obj_000001"]
        assert np.ptp(found[0].vertices_m, axis=0) == pytest.approx(BOX.extents / 1000)
    assert server.requests == ["/toy_models.zip"]


def test_downloaded_tars_of_views(server, tmp_path):
    for instance in (1, 2):
        with tarfile.open(server.folder / f"mug_{instance}.tar", "w") as archive:
            for frame in range(1, 9):
                content = ascii_pcd(["0 0 1 0 0 0"])
                info = tarfile.TarInfo(f"mug_{instance}/mug_{instance}_1_{frame}.pcd")
                info.size = len(content)
                archive.addfile(info, io.BytesIO(content))
    urls = [f"{server.url}/mug_{instance}.tar" for instance in (1, 2)]
    entry = resolve({**CUPS, "urls": urls, "sha256": None, "views_per_instance": 2}, None)
    names = [surface.name for surface in surfaces(entry, tmp_path)]
    assert names == ["mug_1_1_1", "mug_1_1_5", "mug_2_1_1", "mug_2_1_5"]


def test_data_files_are_those_that_are_read(tmp_path):
    entry = CUPS | {"kind": "mesh_folder", "files": ["cups/*.ply", "more/cup_?.ply"]}
    write_bop(tmp_path / "bop" / "toy")
    (tmp_path / "bop" / "toy" / "LICENSE.md").write_text("of the models")
    (tmp_path / "cups").mkdir()
    (tmp_path / "more").mkdir()
    for name in ("cups/b.ply", "cups/a.ply", "cups/notes.txt", "more/cup_1.ply"):
        BOX.export(tmp_path / name, file_type="ply")
    names = [path.relative_to(tmp_path).as_posix() for path in data_files(resolve(entry, str(tmp_path)))]
    assert names == ["cups/a.ply", "cups/b.ply", "more/cup_1.ply"]
    assert [path.name for path in data_files(resolve(BOP, str(tmp_path)))] == ["models_info.json", "obj_000001.ply"]
    assert data_files(resolve({**BOP, "location": "elsewhere"}, str(tmp_path))) == []


def test_a_step_is_told_the_one_folder_that_the_data_of_a_source_comes_from():
    assert data_folders({"origin": "local"}, "/data", "kept") == {"data_dir": "/data"}
    assert data_folders({"origin": "local"}, None, "kept") == {}
    assert data_folders({"origin": "download"}, "/data", "kept") == {"downloads": "kept"}
    assert data_folders({"origin": "procedural"}, "/data", "kept") == {}


REAL = {"title": "YCB", "stand_in": False}
STAND_IN = {"title": "YCB", "stand_in": True}


def test_a_caption_tells_stand_ins_from_a_mixture():
    assert stand_in_clause([REAL, REAL]) == stand_in_clause([]) == ""
    whole, partly = stand_in_clause([STAND_IN, STAND_IN]), stand_in_clause([STAND_IN, REAL])
    assert "stand-in" in whole and "partly" not in whole
    assert partly.replace("partly ", "") == whole
