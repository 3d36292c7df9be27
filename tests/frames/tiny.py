"""What the tiny dataset is made of, and how it is read."""

from pathlib import Path

from gpca.frames.dataset import Dataset, read_models
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.instances import read_instances
from gpca.frames.rgbd_scene import SceneSettings
from gpca.objects.camera import Camera, DepthNoise
from gpca.objects.canonical import ObjectClouds, write_objects
from gpca.objects.surface import Surface

CAMERA = Camera(width=160, height=120, focal_px=150)
PERFECT = DepthNoise(scale=0.0, dropout=0.0)


def surfaces():
    """A brick, a cylinder, a cone, a capsule, and a bracket that no rotation leaves as it is."""
    import trimesh

    create = trimesh.creation
    bracket = [create.box((0.16, 0.04, 0.03)), create.box((0.03, 0.10, 0.03)), create.box((0.03, 0.03, 0.08))]
    for part, shift in zip(bracket[1:], ((0.06, 0.05, 0), (-0.06, 0, 0.05)), strict=True):
        part.apply_translation(shift)
    meshes = {
        "brick": create.box((0.06, 0.09, 0.14)),
        "cylinder": create.cylinder(0.04, 0.12),
        "cone": create.cone(0.05, 0.13),
        "capsule": create.capsule(0.08, 0.035),
        "bracket": trimesh.util.concatenate(bracket),
    }
    return [Surface(name, mesh.vertices, mesh.faces) for name, mesh in meshes.items()]


def scene_settings(noise=PERFECT, **changes):
    return SceneSettings(**{"count": 3, "views": 2, "objects": (4, 5), "camera": CAMERA, "noise": noise} | changes)


def read(folder, out, settings=None, results=None):
    """Return the instances and objects of a dataset's folder."""
    dataset = Dataset("tiny", (Path(folder),), results=(results,) if results else ())
    frames = dataset.frames()
    models = read_models(dataset, frames)
    write_objects((model.surface for model in models.values()), "tiny", out, 2048)
    objects = ObjectClouds.load(out)
    settings = settings or InitialPoseSettings("true_pose")
    return read_instances({"tiny": (dataset, frames, models)}, objects, settings), objects
