import csv
import json

import pytest

from .conftest import without_ends

SMOKE = ("all", "--configfile", "config/smoke.yaml")
COLLECTORS = {"metrics": 1, "timings": 1, "table": 3, "fig_attribution_confusions": 1}
LEARNED = {"active_learning_metrics": 1, "learning_table": 3, "active_learning_curves": 1}
DIAGNOSED = {"learn": 2, "diagnostics": 1, "learner_table": 3, "learner_figure": 3}
KERNELS = {"kernels": 1, "kernel_metrics": 1, "kernel_table": 2, "kernel_learning_curves": 1}
METHOD = {"fig2_overview": 1, "fig4_pipeline": 1}
PICTURES = {"fig5_real_world_example": 1, "real_world_failures": 1}
REAL_WORLD = {"real_world_metrics": 1, "table6_backbones": 1, "confusion_real_world": 1} | PICTURES
BACKBONES = {"explain_with_backbone": 2} | REAL_WORLD
RUNTIME = {"runtime": 1, "table7_runtime": 1, "runtime_figure": 1}
MODEL = {"model": 1} | RUNTIME
RECOVERY_FIGURES = {"recovery_figure": 3}
RECOVERY = {"recover": 2, "recovery_metrics": 1, "table8_recovery": 1} | RECOVERY_FIGURES
# Explainers times two sources: those with a GPC, those on embeddings, those on uncertainties, all.
WITH_GPC, ON_EMBEDDINGS, ON_UNCERTAINTY = ({"explain": 2 * explainers} for explainers in (4, 4, 13))
WITH_GPC["explain"] += 2  # classic features on depth frames


def test_a_table_asked_for_alone_needs_no_figure_and_no_other_explainer(project):
    (project.folder / "baselines/lazy.py").write_text(
        "from gpca.explainers.gpca import GPCA\nfrom gpca.explainers.interface import ExplainerEntry\n"
        "EXPLAINERS = {'lazy': ExplainerEntry('Lazy', GPCA)}\n"
    )
    project.append("config/smoke.yaml", "  lazy: {}\n")
    smoke = ("--configfile", "config/smoke.yaml")
    planned = project.dry_run("results/smoke/tables/table2_per_concept.md", *smoke)
    assert planned.jobs == {
        "objects": 2, "registrations": 4, "encoder": 4, "embeddings": 4, "explain": 4, "table": 1
    }  # fmt: skip
    assert not [path for path in planned.outputs if "lazy" in path or "figures" in path]
    table1 = project.dry_run("results/smoke/tables/table1_single_baselines.md", *smoke)
    assert table1.jobs["explain"] == 8
    assert table1.jobs["uncertainty"] == 2
    assert not [path for path in table1.outputs if "lazy" in path or "removal" in path or "figures" in path]


def test_table3_needs_no_uncertainty_and_no_explainer(planned):
    assert planned.before("results/smoke/tables/table3_active_learning.md") == {
        "objects": 2, "registrations": 4, "encoder": 4, "embeddings": 4, "embeddings_without": 4, "active_learning": 4,
        "active_learning_metrics": 1, "learning_table": 1,
    }  # fmt: skip


def test_table4_needs_its_sources_alone_and_table5_no_explainer(planned):
    assert planned.before("results/smoke/tables/table4_kernels.md") == {
        "objects": 1, "registrations": 2, "encoder": 2, "embeddings": 2, "kernels": 1, "kernel_table": 1,
    }  # fmt: skip
    assert planned.before("results/smoke/tables/table5_learners.md") == {
        "objects": 2, "registrations": 4, "encoder": 4, "embeddings": 4, "shift": 2, "learn": 2, "diagnostics": 1,
        "learner_table": 1,
    }  # fmt: skip


def test_table6_needs_the_frames_alone(planned):
    assert planned.before("results/smoke/tables/table6_backbones.md") == {
        "scenes": 1, "instances": 1, "frame_registrations": 2, "encoder": 2, "embeddings": 2, "reduced_embeddings": 1,
        "explain": 2, "explain_with_backbone": 2, "real_world_metrics": 1, "table6_backbones": 1,
    }  # fmt: skip


def test_table7_needs_the_model_alone_and_table8_only_itself(planned):
    assert planned.before("results/smoke/tables/table7_runtime.md") == {
        "scenes": 1, "instances": 1, "frame_registrations": 1, "encoder": 1, "embeddings": 1, "model": 1, "runtime": 1,
        "table7_runtime": 1,
    }  # fmt: skip
    assert planned.before("results/smoke/tables/table8_recovery.md") == {
        "recover": 2, "recovery_metrics": 1, "table8_recovery": 1,
    }  # fmt: skip


def test_a_finished_run_has_nothing_to_do(finished):
    assert not finished.dry_run(*SMOKE).jobs
    assert not finished.dry_run("smoke").jobs


EDITS = {
    "gpca/classifier/gpc.py": WITH_GPC | COLLECTORS | {"active_learning": 4} | LEARNED | DIAGNOSED | KERNELS | BACKBONES
    | MODEL | RECOVERY | METHOD,
    "gpca/shift/samples.py": {"shift": 2} | DIAGNOSED,
    "baselines/heads.py": DIAGNOSED,
    "gpca/reporting/figures/kernel_grid.py": {"kernel_learning_curves": 1},
    "gpca/active_learning/acquisition.py": {"active_learning": 4, "fig4_pipeline": 1} | LEARNED | RUNTIME,
    "gpca/active_learning/stream.py": {"active_learning": 4, "fig4_pipeline": 1} | LEARNED | RUNTIME,
    "gpca/reporting/figures/active_learning.py": {"active_learning_curves": 1, "fig4_pipeline": 1},
    # Not Table II: it shows GP-CA alone.
    "gpca/alignment/icp_kernels.py": (
        {"uncertainty": 12} | ON_UNCERTAINTY | COLLECTORS | {"table": 2} | RUNTIME | RECOVERY
    ),
    "baselines/softmax_head.py": {"explain": 2} | COLLECTORS | {"table": 1} | RECOVERY,
    "gpca/reporting/figures/contact_sheet.py": {"objects_figure": 2},
    "gpca/reporting/figures/concepts.py": {"fig3_concepts": 1, "fig5_real_world_example": 1} | METHOD,
    # Not the pictures: they show an encoder without reduction.
    "gpca/encoders/reduction.py": {
        "reduced_embeddings": 1, "explain_with_backbone": 1, "real_world_metrics": 1, "table6_backbones": 1,
        "confusion_real_world": 1,
    },
    "gpca/frames/occlusion.py": {
        "frame_registrations": 2, "encoder": 2, "embeddings": 2, "reduced_embeddings": 1, "explain": 2,
    } | BACKBONES | MODEL,
    "gpca/frames/bop.py": {
        "instances": 1, "frame_registrations": 2, "encoder": 2, "embeddings": 2, "reduced_embeddings": 1, "explain": 2,
    } | BACKBONES | MODEL | RECOVERY,
    "gpca/recovery/policy.py": MODEL | RECOVERY,
    "gpca/reporting/tables/explainers.py": {
        "table": 3, "learning_table": 3, "learner_table": 3, "kernel_table": 2, "kernel_learning_curves": 1,
    },
    "gpca/reporting/figures/confusions.py": {"fig_attribution_confusions": 1, "confusion_real_world": 1},
    "gpca/encoders/dgcnn.py": {
        "encoder": 6, "embeddings": 6, "embeddings_without": 4, "active_learning": 4, "shift": 2,
        "reduced_embeddings": 1,
    } | BACKBONES | ON_EMBEDDINGS | COLLECTORS | LEARNED | DIAGNOSED | KERNELS | MODEL | RECOVERY
    | METHOD,
    "gpca/objects/uw_rgbd.py": {},
    "gpca/objects/shapes/cups.py": {
        "objects": 1, "registrations": 2, "encoder": 2, "embeddings": 2, "uncertainty": 6, "explain": 19,
        "objects_figure": 1, "fig3_concepts": 1, "embeddings_without": 2, "active_learning": 2, "shift": 2,
    } | COLLECTORS | LEARNED | DIAGNOSED | METHOD,
}  # fmt: skip


@pytest.mark.parametrize("module", EDITS)
def test_the_rules_that_use_a_module_depend_on_it_and_no_other(planned, module):
    assert without_ends(planned.behind(module)) == EDITS[module]


@pytest.mark.parametrize("name", ["gpca/reporting/page/samples.py", "gpca/reporting/page/templates/page.js"])
def test_what_the_page_alone_uses_makes_the_page_alone(planned, name):
    assert planned.behind(name) == {"page": 1}


def test_the_comparison_comes_after_every_number(planned):
    for name in ("metrics", "active_learning", "real_world", "diagnostics", "kernels", "runtime"):
        assert "comparison" in planned.behind(f"results/smoke/{name}.csv")


@pytest.mark.parametrize("module", ["gpca/classifier/gpc.py", "gpca/encoders/dgcnn.py", "gpca/objects/uw_rgbd.py"])
def test_an_edit_reruns_what_depends_on_the_module(finished, module):
    finished.append(module, "\n# edited\n")
    assert without_ends(finished.dry_run(*SMOKE).jobs) == EDITS[module]


@pytest.mark.parametrize("name", ["gpca", "gpca_paper"])
def test_an_explainer_says_the_same_as_a_learner(smoke, name):
    def rows(path, columns):
        with (smoke.folder / "results/smoke" / path).open() as file:
            return [[row[column] for column in columns] for row in csv.DictReader(file)
                    if row["split"] == "test" and row.get("set", "in_distribution") == "in_distribution"]  # fmt: skip

    columns = ("sample", "object", "concept_true", "score_noise", "variance_pose", "bald")
    learned = rows(f"learners/ycb/{name}/seed1.csv", columns)
    assert len(learned) == 12
    assert learned == rows(f"predictions/ycb/{name}/seed1.csv", columns)


def test_a_touched_but_unchanged_module_reruns_nothing(finished):
    (finished.folder / "gpca/classifier/gpc.py").touch()
    assert not finished.dry_run(*SMOKE).jobs


def test_a_changed_setting_reruns_what_depends_on_it(finished):
    (finished.folder / "mine.yaml").write_text(json.dumps({"explainers": {"gpca": {"iterations": 21}}}))
    planned = finished.dry_run(*SMOKE, "mine.yaml")
    assert without_ends(planned.jobs) == {"explain": 2} | COLLECTORS | DIAGNOSED | BACKBONES | MODEL | RECOVERY | METHOD
    assert not [path for path in planned.outputs if "predictions/" in path and "gpca_paper" in path]


def test_a_figure_of_another_source_is_drawn_alone(finished):
    (finished.folder / "mine.yaml").write_text(json.dumps({"figures": {"source": "ycb"}}))
    assert finished.dry_run(*SMOKE, "mine.yaml").jobs == {"fig3_concepts": 1, "page": 1} | METHOD
