import json

import numpy as np
import pytest

from gpca.alignment.rigid import transform
from gpca.errors import InputError
from gpca.frames.camera import DepthNoise
from gpca.frames.instances import points_on_model
from gpca.frames.rgbd_scene import SceneSettings, lay_table, stable_poses, write_scenes
from gpca.io.files import read_image

from .tiny import PERFECT, scene_settings, surfaces


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


def test_the_true_poses_put_every_measured_point_on_its_model(tiny):
    instances, objects = tiny
    assert len(instances) >= 20
    assert points_on_model(instances, objects).max() < 0.003  # the spacing of the models' points


def test_visible_masks_are_disjoint_parts_of_the_whole_ones(scenes):
    shares = []
    for scene in sorted((scenes / "test").iterdir()):
        for image, objects in json.loads((scene / "scene_gt_info.json").read_text()).items():
            names = [f"{int(image):06d}_{n:06d}.png" for n in range(len(objects))]
            masks, wholes = ([read_image(scene / kind / n, "") > 0 for n in names] for kind in ("mask_visib", "mask"))
            assert np.sum(masks, axis=0).max() == 1
            for mask, whole, counted in zip(masks, wholes, objects, strict=True):
                assert not (mask & ~whole).any()
                assert counted["px_count_visib"] == mask.sum()
                assert counted["visib_fract"] == pytest.approx(mask.sum() / max(1, whole.sum()))
                shares.append(counted["visib_fract"])
    assert min(shares) < 0.9 < max(shares)  # some objects hide others


def test_a_scene_is_the_same_whatever_others_there_are_and_however_often_it_is_drawn(scenes, tmp_path):
    write_scenes(surfaces(), "tiny", scene_settings(count=1), tmp_path / "fewer")
    expected, drawn = files(scenes), files(tmp_path / "fewer")
    assert all(drawn[name] == expected[name] for name in drawn if name != "dataset_info.json")
    assert "test/000000/depth/000001.png" in drawn


def test_noise_changes_depth_and_nothing_else(scenes, tmp_path):
    write_scenes(surfaces(), "tiny", scene_settings(noise=DepthNoise(), count=1), tmp_path / "noisy")
    expected, noisy = files(scenes / "test/000000"), files(tmp_path / "noisy/test/000000")
    assert {name.split("/")[0] for name in noisy if noisy[name] != expected[name]} == {"depth", "scene_gt_info.json"}


def test_models_list_what_leaves_their_shape_as_it_is(scenes):
    info = json.loads((scenes / "models/models_info.json").read_text())
    symmetries = {entry["name"]: {k for k in entry if k.startswith("symmetries")} for entry in info.values()}
    assert symmetries["bracket"] == set()
    assert symmetries["brick"] == {"symmetries_discrete"}
    assert "symmetries_continuous" in symmetries["cone"]


def test_ranges_that_run_downwards_are_refused():
    with pytest.raises(InputError, match=r"distance_m: \[0.9, 0.5\] is in descending order"):
        SceneSettings.from_dict({"distance_m": [0.9, 0.5]})
    assert SceneSettings.from_dict({"noise": {"scale": 0.0, "dropout": 0.0}}).noise == PERFECT
