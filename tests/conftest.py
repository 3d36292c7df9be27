"""Small real things that several tests need: two objects, and registrations made of them."""

import pytest


@pytest.fixture(scope="session")
def objects(tmp_path_factory):
    """A brick and a cone of 600 points each, written to an objects npz and read back."""
    import trimesh

    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.surface import Surface

    meshes = {"brick": trimesh.creation.box((0.04, 0.07, 0.10)), "cone": trimesh.creation.cone(0.03, 0.09)}
    path = tmp_path_factory.mktemp("objects") / "tiny.npz"
    surfaces = (Surface(name, mesh.vertices, mesh.faces) for name, mesh in meshes.items())
    write_objects(surfaces, "tiny", path, n_points=600)
    return ObjectClouds.load(path)


@pytest.fixture(scope="session")
def registrations(objects):
    """36 training and 18 test registrations of clouds of up to 256 points."""
    from gpca.dataset import RegistrationSettings, make_registrations

    return make_registrations(objects, "tiny", 0, RegistrationSettings(train=36, test=18, points=256))[0]
