import csv
import json
from pathlib import Path

import pytest

from .conftest import without_ends

SMOKE = ("all", "--configfile", "config/smoke.yaml")


def assert_made(files, made, not_made, planned):
    """Each word of the first text begins a part of the path of a file, none of the second, though it is planned."""

    def of(paths, word):
        return [path for path in paths if f"/{word}" in path]

    assert [word for word in f"{made} {not_made}".split() if not of(planned.outputs, word)] == []
    assert [word for word in made.split() if not of(files, word)] == []
    assert [path for word in not_made.split() for path in of(files, word)] == []


def test_a_table_asked_for_alone_needs_no_figure_and_no_other_explainer(project):
    (project.folder / "baselines/lazy.py").write_text(
        "from gpca.explainers.gpca import GPCA\nfrom gpca.explainers.interface import ExplainerEntry\n"
        "EXPLAINERS = {'lazy': ExplainerEntry('Lazy', GPCA, ('source',))}\n"
    )
    project.append("config/smoke.yaml", "  lazy: {}\n")
    table1, table2 = (f"results/smoke/tables/table{name}.md" for name in ("1_single_baselines", "2_per_concept"))
    planned = project.dry_run(table1, table2, "--configfile", "config/smoke.yaml")
    assert {path.split("/")[3] for path in planned.needed(table2) if "/predictions/" in path} == {"ycb", "coffee_cup"}
    assert {path.split("/")[4] for path in planned.needed(table2) if "/predictions/" in path} == {"gpca", "gpca_paper"}
    assert not [path for path in planned.needed(table2) if "uncertainty" in path]
    assert {path.split("/")[4] for path in planned.needed(table1) if "/uncertainty/" in path} == {"additive"}
    for unneeded in ("lazy", "figures", "removal"):
        assert not [path for path in planned.outputs if unneeded in path]


NEEDS = {  # a table: what is made for it, and what is not
    "table3_active_learning": ("embeddings/ycb active_learning/ycb", "uncertainty/ predictions causes/ real_rgbd"),
    "table5_learners": ("embeddings/coffee_cup shifted/ycb learners/ycb", "predictions uncertainty/ causes/ real_rgbd"),
    "table6_backbones": ("scenes/ instances/ predictions/real_rgbd", "uncertainty/ causes/ model.pt"),
    "table7_runtime": ("model_causes/ycb model.pt runtime.csv", "predictions uncertainty/ diagnoses/ learners"),
    "table8_recovery": ("recovery/ recovery.csv", "objects/ registrations encoders predictions model.pt"),
    "table12_uncertainty": ("causes/ycb estimates/ycb", "registrations encoders embeddings uncertainty/ predictions"),
    "table19_guarantee": (
        "reenactments/ycb diagnoses/ycb/gpca frame_diagnoses/ guarantee/reenact",
        "predictions estimates learning_curve controls/ uncertainty/ model.pt",
    ),
}


@pytest.mark.parametrize("table", NEEDS)
def test_a_table_needs_its_own_stages_alone(planned, table):
    assert_made(planned.needed(f"results/smoke/tables/{table}.md"), *NEEDS[table], planned)


EDITS = {  # a module: what is made again where it has changed, and what is not
    "gpca/classifier/gpc.py": (
        "predictions/ycb/gpca/ predictions/real_rgbd/gpca_pair diagnoses/ycb/gpca active_learning/ycb kernels/ "
        "learners/ model.pt recovery/ controls/ exchange/ table2_per_concept fig4_pipeline",
        "registrations encoders/ embeddings/ uncertainty/ methods/ estimates/ descriptors/ shifted/ residuals_forest "
        "predictions/ycb/shap_additive diagnoses/ycb/gate_rmse fig3_concepts",
    ),
    "gpca/steps/shift.py": ("shifted/ learners/ table5_shift", "predictions active_learning diagnoses/ model.pt"),
    "gpca/experiments/kernel_grid.py": ("figures/kernel_learning_curves kernels.csv table4_k", "kernels/ figures/fig3"),
    "gpca/active_learning/acquisition.py": (
        "active_learning/ycb frame_labels/ runtime.csv table6_labels",
        "predictions embeddings learners diagnoses/ model.pt kernels/",
    ),
    "gpca/alignment/icp_kernels.py": (
        "uncertainty/ycb/additive predictions/ycb/shap_additive causes/ycb methods/ycb estimates/ycb model.pt recovery",
        "registrations/ encoders/ycb embeddings/ycb predictions/ycb/gpca/ active_learning/ table2_per_concept kernels",
    ),
    "baselines/aligned_source.py": (
        "predictions/ycb/softmax_head recovery/ controls/",
        "predictions/ycb/gpca/ predictions/ycb/shap_additive learners embeddings model.pt gate_rmse",
    ),
    "gpca/frames/synthesis.py": ("poses/ embeddings/real_rgbd model.pt", "scenes instances predictions/ycb causes/"),
    "gpca/causes/policy.py": ("model.pt runtime.csv recovery/ table8_recovery", "predictions encoders diagnoses/"),
    "gpca/experiments/concept_attribution.py": ("table1_extended table2", "predictions metrics.csv figures/cause"),
    "gpca/encoders/dgcnn.py": (
        "encoders/ycb embeddings/ycb predictions/ycb/gpca/ predictions/ycb/concept_vectors shifted/ cause_encoders/ycb "
        "control_embeddings/ table2_per_concept",
        "registrations uncertainty/ causes/ descriptors predictions/real_rgbd/gpca_pair residuals_forest methods/",
    ),
    "gpca/objects/procedural.py": (
        "objects/coffee_cup objects/ycb registrations/coffee_cup predictions/coffee_cup objects_coffee_cup scenes",
        "",
    ),
    "gpca/causes/descriptors.py": (
        "descriptors/ycb diagnoses/ycb/pair_forest estimates/ model.pt repairs/causes/",
        "predictions smoke/causes/ model_causes/ recovery methods/",
    ),
    "gpca/steps/control_samples.py": ("controls/ control_embeddings/ loophole", "predictions embeddings encoders"),
    "gpca/steps/exchange.py": ("exchange/ table14_method_matrix", "estimates/ methods/ predictions"),
}


@pytest.mark.parametrize("module", EDITS)
def test_the_files_that_a_module_makes_depend_on_it_and_no_others(planned, module):
    assert_made(planned.remade(module), *EDITS[module], planned)


@pytest.mark.parametrize("name", ["gpca/page/findings.py", "gpca/page/templates/page.js"])
def test_what_the_page_alone_uses_makes_the_page_alone(planned, name):
    assert planned.behind(name) == {"page": 1}


def test_a_group_of_readings_is_run_again_for_its_own_code_alone(planned):
    again = planned.behind("gpca/steps/readings/subsets.py")
    assert [again[rule] for rule in ("reading", "reading_values", "comparison", "table13_readings")] == [1, 1, 1, 1]


def test_the_comparison_comes_after_every_number(planned):
    for name in ("metrics", "active_learning", "real_world", "diagnostics", "kernels", "runtime"):
        assert "comparison" in planned.behind(f"results/smoke/{name}.csv")


def test_edits_rerun_what_depends_on_the_modules(finished, planned):
    modules = ("gpca/classifier/gpc.py", "gpca/encoders/dgcnn.py", "gpca/objects/point_files.py")
    for module in modules:
        finished.append(module, "\n# edited\n")
    assert without_ends(finished.dry_run(*SMOKE).jobs) == without_ends(planned.behind(*modules))


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


def test_a_finished_run_has_nothing_to_do_nor_has_one_with_a_touched_but_unchanged_module(finished):
    (finished.folder / "gpca/classifier/gpc.py").touch()
    assert not finished.dry_run(*SMOKE).jobs


def test_a_changed_setting_reruns_what_depends_on_it(finished):
    (finished.folder / "mine.yaml").write_text(json.dumps({"explainers": {"gpca": {"iterations": 21}}}))
    planned = finished.dry_run(*SMOKE, "mine.yaml")
    again = "predictions/ycb/gpca/ predictions/real_rgbd learners/ model.pt recovery/ table2_per_concept"
    for word in again.split():
        assert any(word in path for path in planned.outputs), word
    kept = {"register", "train_encoder", "embed", "learn_actively", "learn_on_frames", "diagnose"}
    assert not planned.jobs.keys() & kept
    assert not [path for path in planned.outputs if "predictions/" in path and "gpca_paper" in path]


def test_every_table_figure_and_stage_is_a_target_by_name(project):
    names = ("table5", "kernel_learning_curves", "objects", "paper")
    planned = project.dry_run(*names, "--configfile", "config/smoke.yaml")
    inputs = {rule: files for rule, files, _ in planned.plan if rule in names}
    assert inputs["table5"] == {"results/smoke/tables/table5_learners.md"}
    assert "results/smoke/figures/kernel_learning_curves.pdf" in planned.outputs
    assert inputs["objects"] == {f"results/smoke/objects/{name}.npz" for name in ("coffee_cup", "ycb")}
    paper = inputs["paper"]
    figures = {Path(path).stem for path in paper if "/figures/" in path}
    assert sorted(name.split("_")[0] for name in figures) == [f"fig{n}" for n in range(1, 7)]
    assert not [path for path in paper if "extended" in path or "table8" in path or "index.html" in path]


def test_a_misspelt_target_is_answered_by_the_nearest_names(project):
    done = project.plan("tabel2", "--configfile", "config/smoke.yaml", check=False)
    assert done.returncode != 0
    assert "gpca: target 'tabel2': there is no such table, figure or stage; did you mean table2 or" in done.stderr
    assert "Traceback" not in done.stderr
