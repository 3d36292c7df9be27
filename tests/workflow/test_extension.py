"""What a user adds: a folder of meshes, a rule of an own source, an explainer. None of it touches the suite's files."""

import csv

import numpy as np
import pytest

from gpca.objects.canonical import ObjectClouds

from ..documents import block, blocks_of
from .conftest import without_ends

SMOKE = ("--configfile", "config/smoke.yaml")
COLLECTORS = dict.fromkeys(("metrics", "timings", "attribution_intervals", "table1_extended"), 1)
OLD_ROW = "coffee_cup"


def files_of(source, planned):
    """The planned files of a source, under the name of the old row; `causal` runs are those of the figures' source."""
    parts = [path.split("/") for path in planned.outputs if "causal" not in path]
    return {"/".join(OLD_ROW if part == source else part for part in path) for path in parts if source in path}


def test_a_folder_of_meshes_and_a_rule_of_an_own_source_are_planned_like_others(finished, planned, tmp_path):
    # A folder with three meshes in three formats, in millimetres, as docs/adding.md has it.
    import trimesh

    meshes = tmp_path / "data" / "my_parts"
    meshes.mkdir(parents=True)
    trimesh.creation.box((40, 70, 100)).export(meshes / "brick.stl")
    trimesh.creation.cone(30, 90).export(meshes / "cone.ply")
    trimesh.creation.annulus(20, 35, 25).export(meshes / "ring.obj")
    finished.append("config/sources.yaml", block("config/sources.yaml", "my_parts").removeprefix("sources:\n"))
    data_dir = ("--config", f"data_dir={meshes.parent}")
    again = finished.dry_run("all", *SMOKE, *data_dir)
    assert files_of("my_parts", again) == files_of(OLD_ROW, planned) != set()
    assert {"objects_my_parts", "table1_extended", "table5_shift", "table10_transfer", "model"} < again.jobs.keys()
    # What was learned from the two other sources is asked about the new one too, and the one before it is seen by it.
    of_others = {path for path in again.outputs if "/ycb/" in path}
    taught_by_others = ("control", "diagnoses", "learning_curve", "estimate", "estimator_")
    assert not [path for path in of_others if not any(word in path for word in taught_by_others)]
    assert not again.jobs.keys() & {"fit_kernel_grid", "explain_exchanged", "recover", "render_scenes"}
    assert "results/smoke/predictions/my_parts/gpca/seed1.csv" in again.outputs

    for file, text in blocks_of("docs/adding.md"):
        if "torus" in file:
            (finished.folder / file).parent.mkdir(exist_ok=True)
            (finished.folder / file).write_text(text)
    again = finished.dry_run("all", *SMOKE, *data_dir)
    assert files_of("my_parts", again) == files_of("torus", again) == files_of(OLD_ROW, planned)
    assert again.jobs["torus"] == 1

    made = [f"results/smoke/objects/{name}.npz" for name in ("my_parts", "torus")]
    finished.snakemake("-j2", *made, *SMOKE, *data_dir)
    parts, torus = (ObjectClouds.load(finished.folder / path) for path in made)
    assert parts.names.tolist() == ["brick", "cone", "ring"]
    assert parts.diameters_m[0] == pytest.approx(np.linalg.norm((0.04, 0.07, 0.10)))
    assert torus.diameters_m[0] == pytest.approx(0.11, rel=0.01)


def test_a_table_of_the_docs_is_a_function_and_an_experiment_a_short_file_with_a_line_of_the_config(finished):
    file, table = "gpca/experiments/point_counts.py", "gpca/experiments/abstentions.py"
    text = block(file, "EXPERIMENT")
    assert len(text.splitlines()) <= 62  # with the line that names the file
    (finished.folder / file).write_text(text)
    (finished.folder / table).write_text(block(table))
    finished.append("config/config.yaml", block("config/config.yaml", "point_counts"))
    new = dict.fromkeys(("abstentions", "point_counts", "observed_points"), 1)
    assert finished.dry_run("all", *SMOKE).jobs == new | {"page": 1}

    finished.snakemake("-j2", "abstentions", "observed_points", *SMOKE)
    table = (finished.folder / "results/smoke/tables/abstentions.md").read_text()
    assert "| GP-CA (trained longer) | 0.0 |" in table
    with (finished.folder / "results/smoke/tables/observed_points.csv").open() as file:
        means = {(row["source"], row["concept"]): float(row["mean"]) for row in csv.DictReader(file)}
    assert all(means[source, "overlap"] < means[source, "noise"] for source in ("coffee_cup", "ycb"))
    # A key that a table did not read leaves it as it is; figures of another source take but causal runs of it.
    planned = finished.dry_run("all", *SMOKE, "--config", "run=smoke", "figures={source: ycb}")
    assert {"fig3_concepts", "causes_example", "fig2_overview"} < planned.jobs.keys()
    made = [path for path in planned.outputs if "causal" not in path]
    assert not [path for path in made if "/tables/" in path or path.endswith((".npz", ".csv"))]

    wrong = finished.snakemake("-n", "all", *SMOKE, "--config", "point_counts={splits: test}", check=False)
    assert "config key point_counts.splits: unknown; did you mean split?" in wrong.stderr


EXPLAINER = """
import numpy as np

from gpca.classifier.scores import Attribution
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.perturbation import CONCEPTS


class FitnessOnly:
    def __init__(self, source, seed, sharpness=1.0):
        self.sharpness = sharpness

    def fit(self, registrations):
        self.means = [registrations.fitness[registrations.concept == concept].mean() for concept in CONCEPTS]

    def explain(self, registrations):
        assert not set(registrations.concept) & set(CONCEPTS), "the truth is hidden"
        scores = np.exp(-self.sharpness * np.abs(registrations.fitness[:, None] - self.means))
        nan, zeros = np.full(len(scores), np.nan), np.zeros(len(scores))
        scores = scores / scores.sum(axis=1, keepdims=True)
        return Attribution(CONCEPTS, scores, scores + np.nan, nan, zeros > 0, zeros.astype(int), zeros, zeros)


EXPLAINERS = {"fitness_only": ExplainerEntry("Fitness only", FitnessOnly, ("pair",))}
"""


def test_an_explainer_in_a_file_of_ones_own_becomes_a_row(finished):
    (finished.folder / "fitness_only.py").write_text(EXPLAINER)
    finished.append("config/smoke.yaml", "  fitness_only: {sharpness: 50.0}\nplugins: [fitness_only.py]\n")
    planned = finished.dry_run("all", *SMOKE)
    assert without_ends(planned.jobs) == COLLECTORS | {"attribute": 2}

    finished.snakemake("-j2", "results/smoke/tables/table1_extended.md", *SMOKE)
    table = (finished.folder / "results/smoke/tables/table1_extended.md").read_text()
    assert table.count("| Fitness only |") == 2
    with (finished.folder / "results/smoke/predictions/ycb/fitness_only/seed0.csv").open() as file:
        predictions = list(csv.DictReader(file))
    assert {row["concept_predicted"] for row in predictions} <= {"noise", "pose", "overlap"}
    assert len(predictions) == 48
    finished.append("fitness_only.py", "\n# edited\n")
    again = finished.dry_run("results/smoke/tables/table1_extended.md", *SMOKE)
    shown = ("metrics", "timings", "attribution_intervals", "table1_extended")
    assert again.jobs == dict.fromkeys(shown, 1) | {"attribute": 2}
