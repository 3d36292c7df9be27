"""Files of one source and seed, as a run has them, with embeddings that tell the concepts apart but for some noise."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.attribution.predictions import write_predictions
from gpca.classifier.scores import Attribution
from gpca.io.arrays import save_arrays
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.shifted_sets import DISTANCES, ShiftedSets
from gpca.steps.readings.files import RunFiles
from gpca.steps.readings.groups import ReadingSizes, readings_of

GPC = {"iterations": 20, "inducing": 8, "draws": 50, "learning_rate": 0.1}
SECTIONS = {
    "uncertainty": {"starts": 13, "icp_points": 40, "floor": 1e-4},
    "icp": {"max_iterations": 20},
    "encoder": {"draw_points": 64, "draws": 1, "epochs": 1, "options": {"k": 8, "point_features": 16}},
    "active_learning": {
        "initial": 8,
        "labels": 6,
        "batch": 2,
        "target": 0.9,
        "gpc": GPC,
        "rare": {"labels": 6, "least": 2, "batch": 2, "gpc": GPC},
    },
    "gpca_paper": GPC,
    "gpca": GPC,
    "gpca_matern": GPC | {"kernel": "matern32"},
}


@pytest.fixture(scope="session")
def embedded(registrations):
    random = np.random.default_rng(0)
    h_S_6 = random.normal(size=(len(registrations), 6)).astype(np.float32)
    h_S_6[:, :3] += 4 * (registrations.concept[:, None] == np.array(CONCEPTS))
    return replace(registrations, attached={"embedding": h_S_6})


@pytest.fixture(scope="session")
def run_files(embedded, tmp_path_factory):
    """Everything that a group of readings may read."""
    folder = tmp_path_factory.mktemp("run")
    paths = {
        "registrations": folder / "registrations/tiny/seed0.npz",
        "sets": folder / "shifted/tiny/seed0.npz",
        "predictions": folder / "predictions/tiny/gpca_paper/seed0.csv",
        "embeddings": folder / "embeddings/tiny/dgcnn/none/seed0.npz",
        "retrained": folder / "retrained/weaker/tiny/seed0.npz",
    }
    for path in paths.values():
        path.parent.mkdir(parents=True, exist_ok=True)
    embedded.save(paths["registrations"])
    columns = {name: getattr(embedded, name) for name in ("split", "sample", "concept", "object_name", "cluster")}
    distance = np.linspace(0, 1, len(embedded))[:, None] * np.ones(len(DISTANCES))
    sets = ShiftedSets(
        set=np.full(len(embedded), "in_distribution"), h=embedded.embedding, distance=distance, **columns
    )
    for kind in ("sets", "retrained"):
        sets.save(paths[kind], embedded.axes)
    # Right but for the first test sample of each concept.
    scores_S_3 = 0.8 * (embedded.concept[:, None] == np.array(CONCEPTS)) + 0.1
    scores_S_3[embedded.rows("test")[:3]] = np.roll(scores_S_3[embedded.rows("test")[:3]], 1, axis=1)
    write_predictions(paths["predictions"], embedded, Attribution.of_scores(CONCEPTS, scores_S_3, seconds=0.0))
    arrays = {"h": embedded.embedding, "sample": embedded.sample, "split": embedded.split}
    save_arrays(paths["embeddings"], arrays, embedded.axes)
    return RunFiles(
        registrations={("tiny", 0): paths["registrations"]},
        sets={("tiny", 0): paths["sets"]},
        predictions={("tiny", "gpca_paper", 0): paths["predictions"]},
        embeddings={("tiny", "dgcnn-none", 0): paths["embeddings"]},
        retrained={("weaker", "tiny", 0): paths["retrained"]},
        settings=SECTIONS,
        sizes=ReadingSizes(samples=6),
    )


def rows_of(run, run_files, choices):
    """What a group yields: reading, method, metric and concept -> value."""
    rows = run(run_files, readings_of(choices))
    return {
        (tuple(reading.values()), method, *named): value
        for reading, _, method, _, values in rows
        for named, value in values.items()
    }
