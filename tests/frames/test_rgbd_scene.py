"""Settings and folders that the step ``scenes`` refuses."""

import json
import shutil

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from gpca.errors import InputError
from gpca.frames.instances import median_distance
from gpca.frames.rgbd_scene import lay_table, stable_poses, write_scenes
from gpca.io.files import read_image
from gpca.objects.camera import DepthNoise
from gpca.objects.surface import Surface
from gpca.rigid import transform

from ..hostile import refusal
from .tiny import scene_settings, surfaces


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_objects_rest_on_the_table_and_do_not_touch():
    from shapely import MultiPoint

    objects = surfaces()
    resting = [stable_poses(surface) for surface in objects]
    for scene in range(3):
        standing = lay_table(objects, scene_settings(gap_m=0.01), "tiny", scene, resting)
        placed = [transform(p.T_world_object, objects[p.model].vertices_m) for p in standing]
        assert 4 <= len(standing) <= 5
        assert len({p.model for p in standing}) == len(standing)
        assert max(abs(vertices[:, 2].min()) for vertices in placed) < 1e-9
        outlines = [MultiPoint(vertices[:, :2]).convex_hull for vertices in placed]
        distances = [a.distance(b) for n, a in enumerate(outlines) for b in outlines[:n]]
        assert 0.01 - 1e-9 <= min(distances) < 0.02  # apart, but cluttered


def test_true_poses_put_measured_points_on_their_models_and_visible_masks_are_disjoint(tiny, scenes):
    instances, objects = tiny
    assert len(instances) >= 20
    for i, index in enumerate(instances.object_index):
        tree, T_camera_object = cKDTree(objects.points(index)), instances.T_camera_object_true[i]
        assert median_distance(tree, T_camera_object, instances.cloud_m(i)) < 0.003  # the spacing of the models' points
    for scene in sorted((scenes / "test").iterdir()):
        for image, objects in json.loads((scene / "scene_gt.json").read_text()).items():
            names = [f"{int(image):06d}_{n:06d}.png" for n in range(len(objects))]
            assert np.sum([read_image(scene / "mask_visib" / name, "") > 0 for name in names], axis=0).max() == 1


def test_a_scene_is_the_same_whatever_others_there_are_and_noise_changes_its_depth_alone(scenes, tmp_path):
    write_scenes(surfaces(), "tiny", scene_settings(count=1), tmp_path / "fewer")
    expected, drawn = files(scenes), files(tmp_path / "fewer")
    assert all(drawn[name] == expected[name] for name in drawn)
    assert "test/000000/depth/000001.png" in drawn
    write_scenes(surfaces(), "tiny", scene_settings(noise=DepthNoise(), count=1), tmp_path / "noisy")
    expected, noisy = files(scenes / "test/000000"), files(tmp_path / "noisy/test/000000")
    assert {name.split("/")[0] for name in noisy if noisy[name] != expected[name]} == {"depth"}


def test_models_list_what_leaves_their_shape_as_it_is(scenes):
    info = json.loads((scenes / "models/models_info.json").read_text())
    symmetries = {entry["name"]: {k for k in entry if k.startswith("symmetries")} for entry in info.values()}
    assert symmetries["bracket"] == set()
    assert symmetries["brick"] == {"symmetries_discrete"}
    assert "symmetries_continuous" in symmetries["cone"]


def surface(mesh, name="thing"):
    return Surface(name, np.asarray(mesh.vertices), np.asarray(mesh.faces))


def test_a_brick_rests_most_often_on_its_largest_side():
    poses_n, probabilities_n = stable_poses(surface(trimesh.creation.box((0.3, 0.2, 0.1))))
    assert len(poses_n) == 6
    assert probabilities_n.sum() == pytest.approx(1)
    height_n = np.abs(poses_n[:, 2, :3] @ [0.3, 0.2, 0.1])
    assert height_n[np.argmax(probabilities_n)] == pytest.approx(0.1)


def test_an_open_scan_with_its_centre_of_mass_outside_still_rests():
    """Of a bowl without a lid whose integral ends outside of it: trimesh alone would look for a centre without end."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    ball.apply_translation((0, 0, 1.0))
    bowl = ball.slice_plane((0, 0, 1.0), (0, 0, -1))
    assert not bowl.is_watertight
    assert bowl.center_mass[2] < bowl.vertices[:, 2].min()
    poses_n, probabilities_n = stable_poses(surface(bowl))
    assert probabilities_n.sum() == pytest.approx(1)
    for pose in poses_n:
        assert trimesh.transform_points(bowl.vertices, pose)[:, 2].min() == pytest.approx(0, abs=1e-9)


def test_a_flat_object_is_refused():
    square = trimesh.Trimesh([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0)], [(0, 1, 2), (0, 2, 3)])
    with pytest.raises(InputError, match="object 'card': is flat and cannot be stood on a table; leave it out"):
        stable_poses(surface(square, "card"))


SETTINGS = {
    "no room": ({"gap_m": 1.0, "objects": [8, 8]}, "there is no room for 8 objects 1.0 m apart"),
    "downwards": ({"objects": [5, 2]}, "scenes objects: [5, 2] is in descending order"),
    "a family that is none": ({"families": ["spoons"]}, "family 'spoons': no such procedural family"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_of_scenes_that_cannot_be(tmp_path, name):
    given, words = SETTINGS[name]
    small = {"count": 2, "views": 1, "camera": {"width": 64, "height": 48, "focal_px": 60}, "families": ["linemod"]}
    arguments = ["scenes", "--source", "tiny", "--settings", json.dumps({**small, **given}), "--out", "drawn"]
    refusal(arguments, tmp_path, words)


def test_scenes_replace_scenes(scenes, tmp_path):
    shutil.copytree(scenes, tmp_path / "tiny")
    write_scenes(surfaces(), "tiny", scene_settings(count=2, views=1), tmp_path / "tiny")
    assert len(list((tmp_path / "tiny").rglob("depth/*.png"))) == 2
