"""Every pose of every estimator is a start by itself, and what no estimator found gets an error made elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.frames.dataset import Dataset, read_models
from gpca.frames.instances import CARRIED, GLOBAL, LADDER, NATIVE, TRANSPLANTED, Starts, all_starts
from gpca.objects.canonical import CARRIED as IS_CARRIED
from gpca.objects.canonical import Place
from gpca.rigid import inverse, rotation_angle_rad

HEAD = "scene_id,im_id,obj_id,score,R,t,time"
OFF_MM = (30.0, 0.0, 0.0)


def results(path, dataset, scene, off_mm):
    """A results file with the true poses of one scene, moved."""
    lines = [HEAD]
    for frame in dataset.frames():
        for annotation in frame.annotations if frame.scene == scene else ():
            R = " ".join(f"{value:.9f}" for value in annotation.T_camera_model[:3, :3].ravel())
            t = " ".join(f"{value:.6f}" for value in 1000 * annotation.T_camera_model[:3, 3] + off_mm)
            lines.append(f"{frame.scene},{frame.image},{annotation.object_id},1,{R},{t},-1")
    path.write_text("\n".join(lines))
    return path


@pytest.fixture
def read(scenes, tiny, tmp_path):
    """Return a function to the starts where two estimators have results for the first scene."""
    bare = Dataset("tiny", (scenes,), most_frames=None)
    scene = min(frame.scene for frame in bare.frames())
    files = [results(tmp_path / f"{name}.csv", bare, scene, off) for name, off in (("a", (0, 0, 0)), ("b", OFF_MM))]
    models = {"tiny": read_models(bare, bare.frames())}

    def starts(rungs=(), with_results=True, instances=tiny[0], **changes):
        dataset = replace(bare, results=tuple(files) if with_results else (), **changes)
        return all_starts(instances, tiny[1], {"tiny": dataset}, models, rungs)

    return starts, scene, tiny[0]


def test_every_estimator_is_a_start_and_what_none_found_gets_an_error(read):
    starts, scene, instances = read
    found = starts()
    in_scene = np.flatnonzero(instances.scene == scene)
    native = found.subset(np.flatnonzero(found.kind == NATIVE))
    assert native.instance.tolist() == np.repeat(in_scene, 2).tolist()
    assert native.init_from.tolist() == ["a", "b"] * len(in_scene)
    T_true = instances.T_camera_object_true[native.instance]
    assert np.allclose(native.T_camera_object_init[::2], T_true[::2], atol=1e-6)
    assert np.allclose((native.T_camera_object_init - T_true)[1::2, 0, 3], OFF_MM[0] / 1000, atol=1e-6)
    others = found.subset(np.flatnonzero(found.kind == TRANSPLANTED))
    assert others.instance.tolist() == np.flatnonzero(instances.scene != scene).tolist()
    assert set(others.init_from) == {"errors"}


def test_scenes_whose_estimates_were_carried_over_are_a_kind_by_themselves(read):
    starts, scene, instances = read
    places = {number: Place("", "evaluation", 0) for number in set(instances.scene.tolist())}
    places[scene] = places[scene]._replace(estimates=IS_CARRIED)
    assert set(starts(places=places).kind) == {CARRIED, TRANSPLANTED}


def test_a_rung_has_its_size_and_the_draws_of_its_instance(read):
    starts, _, instances = read
    found = starts(rungs=[(30.0, 0.0), (60.0, 0.1)], with_results=False)
    assert set(found.kind) == {LADDER}
    assert len(found) == 2 * len(instances)
    for T_true, T_init, rung in zip(
        instances.T_camera_object_true[found.instance], found.T_camera_object_init, found.init_from, strict=True
    ):
        assert np.rad2deg(rotation_angle_rad(inverse(T_true) @ T_init)) == pytest.approx(float(rung.split()[0]))
    again = starts(rungs=[(30.0, 0.0)], with_results=False)
    assert (again.T_camera_object_init == found.T_camera_object_init[::2]).all()


def test_global_registration_is_an_estimate_in_the_image(read):
    starts, _, instances = read
    found = starts(with_results=False, instances=replace(instances, init_from=np.full(len(instances), GLOBAL)))
    assert set(found.kind) == {NATIVE}
    assert (found.T_camera_object_init == instances.T_camera_object_init).all()


def test_a_file_of_starts_is_read_as_it_was_written_and_for_its_seed_alone(read, tmp_path):
    starts, _, _ = read
    found, path = starts(rungs=[(30.0, 0.1)]), tmp_path / "starts.npz"
    found.save(path, ("tiny", 100))
    again = Starts.load(path, ("tiny", 100))
    assert all(np.array_equal(again.arrays[name], values) for name, values in found.arrays.items())
    with pytest.raises(InputError, match="seed 100"):
        Starts.load(path, ("tiny", 101))
    np.savez(path, **dict(np.load(path)) | {"T_camera_object_init": np.zeros((len(found), 4, 3))})
    with pytest.raises(InputError, match="array 'T_camera_object_init' is"):
        Starts.load(path, ("tiny", 100))
