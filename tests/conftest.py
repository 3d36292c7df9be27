"""Small real things that several tests need: three objects, and registrations made of them."""

import os

import pytest

from gpca.process.processor import THREAD_VARIABLES, prepare

# One thread, as in a job of the workflow, and before numba is imported: on a busy machine its threads, with so little
# work each, spend most of their time waiting for one another.
prepare()

pytest_plugins = (
    "tests.failures",
    "tests.figures",
    "tests.plugins_apart",
)  # more fixtures, for tests of several folders

# The kernels of the smoke run: what the tests of these compile beside the modules is copied with them for that run.
COMPILING = ("tests/alignment/test_batched_icp.py", "tests/encoders/test_dgcnn.py", "tests/encoders/test_training.py")


def pytest_collection_modifyitems(items):
    """First are the tests that compile what others need compiled."""
    items.sort(key=lambda item: not item.nodeid.startswith(COMPILING))


@pytest.fixture(autouse=True)
def threads_restored(monkeypatch):
    """The command line sets these for its own process, which here is that of all tests."""
    for variable in THREAD_VARIABLES:
        monkeypatch.setenv(variable, os.environ.get(variable, "1"))


@pytest.fixture(scope="session")
def objects(tmp_path_factory):
    """A brick, a cone and a capsule of 600 points each, written to an objects npz and read back.

    As many as there are concepts, so that a sample's number can give away both if they are dealt out carelessly.
    """
    import trimesh

    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.surface import Surface

    meshes = {
        "brick": trimesh.creation.box((0.04, 0.07, 0.10)),
        "cone": trimesh.creation.cone(0.03, 0.09),
        "capsule": trimesh.creation.capsule(0.06, 0.02),
    }
    path = tmp_path_factory.mktemp("objects") / "tiny.npz"
    surfaces = (Surface(name, mesh.vertices, mesh.faces) for name, mesh in meshes.items())
    write_objects(surfaces, "tiny", path, n_points=600)
    return ObjectClouds.load(path)


@pytest.fixture(scope="session")
def registrations(objects):
    """36 training and 18 test registrations of clouds of up to 256 points."""
    from gpca.pairs.synthesis import RegistrationSettings, make_registrations

    return make_registrations(objects, "tiny", 0, RegistrationSettings(train=36, test=18, cloud_points=256))[0]


@pytest.fixture(scope="session")
def diagnoser():
    """A diagnoser of twelve pairs whose features were drawn; two thirds failed."""
    import numpy as np

    from gpca.causes.settings import CauseSettings
    from gpca.classifier.settings import GPCSettings
    from gpca.model.diagnoser import TrainingSet, learn
    from gpca.model.file import FEATURE_COUNT
    from gpca.reenactment.settings import ReenactmentSettings

    random, label_N = np.random.default_rng(0), np.array(["nominal", "noise", "pose"] * 4)
    failed_N = label_N != "nominal"
    training = TrainingSet(
        features_N_F=random.normal(size=(12, FEATURE_COUNT)) + 3 * failed_N[:, None],
        label_N=label_N,
        dominant_N=np.where(failed_N, label_N, "pose"),
        causes_N_3=np.repeat(failed_N[:, None], 3, axis=1),
        shown_error_N=np.where(failed_N, 0.2, 0.005),
        family_N=np.repeat(["box", "can"], 6),
        distance_N_K=np.where(failed_N, 0.2, 0.004)[:, None] * [1.0, 1.1],
        weight_N_K=np.tile([0.9, 0.1], (12, 1)),
        inlier_rmse_N=np.where(failed_N, 0.05, 0.01),
        fitness_N=np.where(failed_N, 0.6, 1.0),
    )
    gpc = GPCSettings(learning_rate=0.1, iterations=20, inducing=4, draws=50)
    reenactment = ReenactmentSettings(hypotheses=2)
    return learn(training, gpc, CauseSettings(points=(64, 128), moved="observed"), reenactment, 0.05, "tiny", 0)[0]


@pytest.fixture(scope="session")
def model(registrations, diagnoser):
    """A model of an encoder that was not trained: its embeddings tell concepts apart well enough to be scored."""
    import torch

    from gpca.alignment.icp import ICPSettings
    from gpca.causes.policy import RecoveryPolicy, Thresholds
    from gpca.classifier.gpc import GPC
    from gpca.classifier.settings import GPCSettings
    from gpca.encoders.inference import TrainedEncoder
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import embed, make_model
    from gpca.model.clouds import Familiarity
    from gpca.model.file import Model
    from gpca.pairs.perturbation import CONCEPTS

    settings = EncoderSettings(draw_points=64, draws=2, options={"k": 8, "point_features": 16})
    torch.manual_seed(0)
    network = make_model(settings).eval()
    train = registrations.subset(registrations.rows("train"))
    h_S_d, _ = embed(network, train, "tiny", 0, settings)
    gpc = GPC(CONCEPTS, GPCSettings(learning_rate=0.1, iterations=40, inducing=12, draws=200), "tiny", 0)
    gpc.fit(h_S_d, train.concept)
    policy = RecoveryPolicy(Thresholds(uncertain=1.0, dominant=0.4))
    familiar = Familiarity.of((train.cloud(row), train.target(row)) for row in range(len(train)))
    encoder = TrainedEncoder.of(network.encoder, settings)
    return Model(diagnoser, encoder, gpc, ICPSettings(), 256, policy, "Tiny", True, familiar)


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """A tiny dataset of the virtual camera, shared and so only read: five objects, three tables, two views of each."""
    from gpca.frames.rgbd_scene import write_scenes

    from .frames.tiny import scene_settings, surfaces

    folder = tmp_path_factory.mktemp("scenes") / "tiny"
    write_scenes(surfaces(), "tiny", scene_settings(), folder)
    return folder


@pytest.fixture(scope="session")
def tiny(scenes, tmp_path_factory):
    """Instances and objects of the tiny dataset."""
    from .frames.tiny import read

    return read(scenes, tmp_path_factory.mktemp("objects") / "tiny.npz")


FOUR = ("002_master_chef_can", "019_pitcher_base", "035_power_drill", "037_scissors")
FEW_CAUSES = {"train": 12, "test": 8, "points": (128, 256), "clean_pairs": 20}


@pytest.fixture(scope="session")
def four(tmp_path_factory):
    """Four procedural objects, one of them symmetric."""
    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.procedural import surfaces

    path = tmp_path_factory.mktemp("objects") / "four.npz"
    write_objects((surface for surface in surfaces("ycb") if surface.name in FOUR), "four", path, n_points=6000)
    return ObjectClouds.load(path)


@pytest.fixture(scope="session")
def drawn(four):
    """Registrations with measured causes, the tally of their candidates, and seconds."""
    from gpca.causes.drawing import draw_causes
    from gpca.causes.settings import CauseSettings

    return draw_causes(four, "four", 100, CauseSettings(**FEW_CAUSES))


@pytest.fixture(scope="session")
def causes(drawn):
    return drawn[0]


@pytest.fixture(scope="session")
def smoke_plan():
    """What Snakemake prints of a dry run of the whole smoke run."""
    from benchmarks.targets import plan

    return plan("smoke", None, [])
