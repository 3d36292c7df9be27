"""The bracket of the tiny dataset in one of its frames, and what may be wrong with it there."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.frames.dataset import Dataset, read_models
from gpca.frames.instances import Starts

BRACKET = "bracket"  # no rotation leaves it as it is, so that ADD sees every error


def models_in(scenes):
    """The models of the dataset's folder, by its name and their ids."""
    dataset = Dataset("tiny", (scenes,))
    return {"tiny": read_models(dataset, dataset.frames())}


def most_seen(instances, objects):
    """The instance of the bracket with most pixels, alone, started from the truth."""
    sizes = np.diff(instances.offsets) * (instances.object_index == objects.row(f"tiny {BRACKET}"))
    return only(instances, int(sizes.argmax()))


def only(instances, i, points_m=None, pixels=None):
    """One instance from its true pose, with other points where they are given."""
    columns = {
        name: getattr(instances, name)[[i]]
        for name in ("dataset", "scene", "image", "object_index", "symmetric", "init_from", "camera_3_3", "colour")
    }
    points_m = instances.cloud_m(i) if points_m is None else points_m.astype(np.float32)
    pixels = instances.pixels_of(i) if pixels is None else pixels
    poses = dict.fromkeys(("T_camera_object_true", "T_camera_object_init"), instances.T_camera_object_true[[i]])
    return replace(instances, **columns, **poses, points_m=points_m, pixels=pixels, offsets=np.array([0, len(pixels)]))


def hidden(seen):
    """The same behind something that leaves the leftmost pixels alone."""
    kept = np.argsort(seen.pixels[:, 0], kind="stable")[: len(seen.pixels) // 4]
    return only(seen, 0, seen.points_m[kept], seen.pixels[kept])


def misplaced(seen):
    """The same, started from a pose that is turned by 100°."""
    T_wrong = np.eye(4)
    T_wrong[:3, :3] = Rotation.from_rotvec([0, np.deg2rad(100), 0]).as_matrix()
    return replace(seen, T_camera_object_init=seen.T_camera_object_true @ T_wrong)


def noisy(seen):
    """The same through a sensor that errs by 2 % of the distance."""
    along = 1 + np.random.default_rng(100).normal(scale=0.02, size=(len(seen.points_m), 1))
    return only(seen, 0, seen.points_m * along)


def own_starts(instances, kind="native"):
    """Starts at the instances' own initial poses."""
    numbers = np.arange(len(instances))
    return Starts(numbers, np.full(len(numbers), kind), instances.init_from, instances.T_camera_object_init)
