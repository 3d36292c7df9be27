"""Single views as objects of a source: cut out of frames, or rendered of meshes."""

import json
import shutil

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.errors import InputError
from gpca.frames import bop
from gpca.objects import camera
from gpca.objects.canonical import ObjectClouds, write_objects
from gpca.objects.source import data_files, resolve, source_modules
from gpca.objects.source import surfaces as surfaces_of
from gpca.objects.surface import Surface, evenly, instance_of
from gpca.rigid import inverse, transform

from ..config.configs import load
from .tiny import surfaces as meshes


def test_a_view_of_a_frame_is_what_was_measured_of_the_object(scenes, tiny):
    instances, objects = tiny
    found = list(bop.from_entry({"views_per_instance": 100}, scenes))
    assert len(found) == len(instances)
    assert len({view.name for view in found}) == len(found)
    assert {instance_of(view.name) for view in found} == {f"obj_{number:06d}" for number in range(1, 6)}
    for view in found[:3]:
        assert view.faces is None
        of_object = [i for i in range(len(instances)) if len(instances.cloud_m(i)) == len(view.vertices_m)]
        [i] = [i for i in of_object if np.allclose(instances.cloud_m(i), view.vertices_m, atol=1e-6)]
        on_object_m = transform(inverse(instances.T_camera_object_true[i]), view.vertices_m)
        surface = cKDTree(objects.points(int(instances.object_index[i])))
        assert np.median(surface.query(on_object_m)[0]) < 0.004


def test_views_are_few_and_of_the_objects_that_are_wanted(scenes):
    found = [view.name for view in bop.from_entry({"objects": [2], "views_per_instance": 2}, scenes)]
    assert len(found) == 2 and all(name.startswith("obj_000002_") for name in found)
    assert evenly([1, 2, 3, 4], 2) == [1, 3] and evenly([1, 2], 9) == [1, 2]
    with pytest.raises(InputError, match="no frame shows object 77; check objects"):
        list(bop.from_entry({"objects": [77]}, scenes))
    with pytest.raises(InputError, match="objects: is an empty list; name the objects"):
        list(bop.from_entry({"objects": []}, scenes))
    with pytest.raises(InputError, match="unit 'm': is not that of BOP frames"):
        list(bop.from_entry({"unit": "m"}, scenes))


def test_a_view_with_next_to_no_points_is_left_out_and_named(scenes, tmp_path, capsys):
    shutil.copytree(scenes, tmp_path / "tiny")
    [first, *_] = sorted((tmp_path / "tiny").glob("test*/*/scene_gt.json"))
    truth = json.loads(first.read_text())
    image = min(truth, key=int)
    mask = first.parent / f"mask_visib/{int(image):06d}_000000.png"
    from PIL import Image

    Image.fromarray(np.zeros_like(np.asarray(Image.open(mask)))).save(mask)
    whole, fewer = (
        len(list(bop.from_entry({"views_per_instance": 99}, folder))) for folder in (scenes, tmp_path / "tiny")
    )
    assert fewer == whole - 1
    assert f"skipped: {mask}" in capsys.readouterr().err


def test_what_a_masks_rim_sees_behind_the_object_is_cut_off():
    random = np.random.default_rng(0)
    own_m = random.normal(scale=0.03, size=(500, 3)) * [1, 1, 0.3]
    behind_m = random.normal(scale=0.01, size=(20, 3)) + np.array([0, 0, 0.5])
    kept_m = bop.within_rim(np.concatenate([own_m, behind_m]))
    assert kept_m[:, 2].max() < 0.1 and len(kept_m) > 480


def test_rendered_views_show_the_side_of_a_mesh_that_faces_the_camera():
    brick, *_ = meshes()
    found = list(camera.rendered_views(brick, 3))
    assert [view.name for view in found] == ["brick_1_0", "brick_2_1", "brick_3_2"]
    for view in found:
        assert np.linalg.norm(np.median(view.vertices_m, axis=0)) == pytest.approx(camera.VIEW_DISTANCE_M, abs=0.1)
        assert np.ptp(view.vertices_m[:, 2]) < 0.2 and len(view.vertices_m) > 1000
    again = list(camera.rendered_views(brick, 3))
    assert np.array_equal(again[1].vertices_m, found[1].vertices_m)
    with pytest.raises(InputError, match="object 'cloud': is a cloud"):
        list(camera.rendered_views(Surface("cloud", brick.vertices_m, None), 1))


def test_the_config_of_cups_has_the_real_views_that_there_are():
    sources = check(without_false(load("cup_views")))
    assert list(sources) == ["coffee_cup", "coffee_cup_views", "coffee_cup_rendered_views"]
    views = list(surfaces_of(sources["coffee_cup_views"], "nowhere"))
    assert [view.name for view in views] == [
        *(f"obj_000014_0_{1000 * image + 1}" for image in (1, 4, 7, 10, 20)), "obj_000014_48_1002",
    ]  # fmt: skip
    assert min(len(view.vertices_m) for view in views) > 2 * 2048  # as many as source and target take
    assert len(data_files(sources["coffee_cup_rendered_views"])) == 11


def test_views_are_kinds_of_source(scenes, tmp_path):
    """Their normals point to the camera, and all views of an object are one family."""
    shutil.copytree(scenes, tmp_path / "tiny")
    entry = {"title": "Views", "kind": "bop_views", "location": "tiny", "objects": [1], "views_per_instance": 2}
    resolved = resolve(entry, str(tmp_path))
    assert source_modules(resolved) == ["gpca.frames.bop"]
    write_objects(surfaces_of(resolved, tmp_path), "views", tmp_path / "views.npz")
    objects = ObjectClouds.load(tmp_path / "views.npz")
    assert {objects.family(i) for i in range(len(objects))} == {"obj_000001"}
    assert (objects.normals(0)[:, 2] < 0.2).mean() > 0.9
