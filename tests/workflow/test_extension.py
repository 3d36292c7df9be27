"""What a user adds: a folder of meshes, a rule of an own source, an explainer. None of it touches the suite's files."""

import csv

import numpy as np
import pytest

from gpca.objects.canonical import ObjectClouds

from .conftest import without_ends

SMOKE = ("--configfile", "config/smoke.yaml")
ROW = {"objects": 1, "registrations": 2, "encoder": 2, "embeddings": 2, "uncertainty": 6, "explain": 19}
ROW |= {"shift": 1, "learn": 1}
ROW |= {"objects_figure": 1, "embeddings_without": 2, "active_learning": 2}
COLLECTORS = {"metrics": 1, "timings": 1, "table": 3, "fig_attribution_confusions": 1}
LEARNED = {"active_learning_metrics": 1, "learning_table": 3, "active_learning_curves": 1}
LEARNED |= {"diagnostics": 1, "learner_table": 3, "learner_figure": 3}


@pytest.fixture
def meshes(tmp_path):
    """A folder with three meshes in three formats, in millimetres."""
    import trimesh

    folder = tmp_path / "data" / "parts"
    folder.mkdir(parents=True)
    trimesh.creation.box((40, 70, 100)).export(folder / "brick.stl")
    trimesh.creation.cone(30, 90).export(folder / "cone.ply")
    trimesh.creation.annulus(20, 35, 25).export(folder / "ring.obj")
    return folder


def test_a_folder_of_meshes_becomes_a_row_by_one_entry(finished, meshes):
    finished.append(
        "config/sources.yaml", "  my_parts: {title: My parts, kind: mesh_folder, location: parts, unit: mm}\n"
    )
    data_dir = ("--config", f"data_dir={meshes.parent}")
    planned = finished.dry_run("all", *SMOKE, *data_dir)
    assert without_ends(planned.jobs) == ROW | COLLECTORS | LEARNED
    assert "results/smoke/predictions/my_parts/gpca/seed1.csv" in planned.outputs

    path = "results/smoke/objects/my_parts.npz"
    finished.snakemake("-j1", path, *SMOKE, *data_dir)
    objects = ObjectClouds.load(finished.folder / path)
    assert objects.names == ("brick", "cone", "ring")
    assert objects.diameters_m[0] == pytest.approx(np.linalg.norm((0.04, 0.07, 0.10)))


RULE = """
SOURCES["ball"] = {"title": "Ball", "stand_in": True}


rule ball:
    output:
        "results/{run}/objects/ball.npz",
    shell:
        "python ball.py {output}"
"""
BALL = """
import sys
import trimesh
from gpca.objects.canonical import write_objects
from gpca.objects.surface import Surface

ball = trimesh.creation.icosphere(radius=0.05)
write_objects([Surface("ball", ball.vertices, ball.faces)], "ball", sys.argv[1], n_points=2048)
"""


def test_a_rule_of_an_own_source_becomes_a_row(finished):
    folder = finished.folder / "workflow/rules/sources"
    folder.mkdir(exist_ok=True)
    (folder / "ball.smk").write_text(RULE)
    (finished.folder / "ball.py").write_text(BALL)
    planned = finished.dry_run("all", *SMOKE)
    assert (
        without_ends(planned.jobs)
        == {rule: ROW[rule] for rule in ROW if rule != "objects"} | {"ball": 1} | COLLECTORS | LEARNED
    )
    assert "results/smoke/predictions/ball/gpca_paper/seed0.csv" in planned.outputs
    registrations = "results/smoke/registrations/ball/seed0.npz"
    finished.snakemake("-j1", registrations, *SMOKE)
    assert (finished.folder / registrations).is_file()


EXPLAINER = """
import numpy as np

from gpca.attribution import Attribution
from gpca.explainer import Entry
from gpca.perturbation import CONCEPTS


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


EXPLAINERS = {"fitness_only": Entry("Fitness only", FitnessOnly)}
"""


def test_an_explainer_dropped_into_baselines_becomes_a_row(finished):
    (finished.folder / "baselines/fitness_only.py").write_text(EXPLAINER)
    assert not finished.dry_run("all", *SMOKE).jobs
    finished.append("config/smoke.yaml", "  fitness_only: {sharpness: 50.0}\n")
    planned = finished.dry_run("all", *SMOKE)
    assert without_ends(planned.jobs) == COLLECTORS | {"explain": 3, "table": 1}

    finished.snakemake("-j2", "results/smoke/tables/table1_extended.md", *SMOKE)
    table = (finished.folder / "results/smoke/tables/table1_extended.md").read_text()
    assert table.count("| Fitness only |") == 3
    with (finished.folder / "results/smoke/predictions/ycb/fitness_only/seed0.csv").open() as file:
        predictions = list(csv.DictReader(file))
    assert {row["concept_predicted"] for row in predictions} <= {"noise", "pose", "overlap"}
    assert len(predictions) == 48


def test_a_wrong_setting_of_an_own_explainer_stops_at_load(project):
    (project.folder / "baselines/fitness_only.py").write_text(EXPLAINER)
    project.append("config/smoke.yaml", "  fitness_only: {sharpnes: 50.0}\n")
    done = project.snakemake("-n", "all", *SMOKE, check=False)
    assert done.returncode != 0
    assert "gpca: config key explainers.fitness_only: explainer 'fitness_only': got an unexpected" in done.stderr
