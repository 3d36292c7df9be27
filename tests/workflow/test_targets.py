import csv
import json
from collections import Counter
from pathlib import Path

import pytest

from .conftest import without_ends

SMOKE = ("all", "--configfile", "config/smoke.yaml")


def jobs(*rules, **counts):
    """How many jobs of each rule: one of each that is named alone."""
    return Counter(rules) + Counter(counts)


TABLES1 = jobs("table1_single_baselines", "table1_extended", "table2_per_concept")
COLLECTORS = jobs("metrics", "timings", "table1_extended", "fig_attribution_confusions")
TABLES3 = jobs("table3_active_learning", "table3_extended", "table3_stream")
NEW_SHOWN = jobs("table15_new_concepts", "table15_oracle", "new_concept_curves")
NEW = jobs("new_concepts", learn_new_concepts=2)
LEARNED = jobs("active_learning", "active_learning_curves", "active_learning_overlap") + TABLES3 + NEW_SHOWN
TABLES5 = jobs("table5_learners", "table5_compact", "table5_shift")
DIAGNOSED = jobs("diagnostics", "coverage_risk", "reliability", "uncertainty_vs_distance", fit_learners=2) + TABLES5
TABLES4 = jobs("table4_kernels", "table4_grid")
KERNELS = jobs("fit_kernel_grid", "kernels", "kernel_learning_curves") + TABLES4
METHOD = jobs("fig2_overview", "fig4_pipeline")
FRAMES = jobs("real_world", "table6_backbones", "table6_seen_unseen", "table6_labels", "confusion_real_world")
PICTURES = jobs("fig5_real_world_example", "real_world_failures")
RUNTIME = jobs("time_stages", "table7_runtime", "runtime")
MODEL = jobs("model") + RUNTIME
RECOVERY_FIGURES = jobs("recovery_rates", "queued_labels", "fig6_mitigation", "fig1_recovery_example")
RECOVERY = jobs("recovery", "table8_recovery", recover=2) + RECOVERY_FIGURES
METHODS = jobs("registration_methods", "table11_registration", "table11_severity")
ESTIMATED = jobs("estimator_metrics", "table12_uncertainty", "estimators")
# GP-CA on the two reductions of Table VI, learning curves of the first seed, and what shows them.
BACKBONES = jobs("learn_on_frames", attribute=2) + FRAMES + PICTURES
LABELLED = jobs("learn_on_frames") + FRAMES
# What four explainers say of the causes: from the samples on, and what is made of it.
CAUSES_SHOWN = jobs("cause_metrics", "cause_intervals", "table9_causes", "causes_example", "cause_confusions")
CAUSES_SHOWN += jobs("nominal_reliability")
# The same explainers on depth frames.
ON_FRAMES = jobs("measure_frame_causes", "frame_causes", "table9_frames")
CAUSES_SHOWN += ON_FRAMES
MODEL_CAUSES = jobs(sample_model_causes=2, describe_model_causes=2)
CAUSES = jobs(sample_causes=4, describe=4, train_on_causes=4, diagnose=8) + CAUSES_SHOWN
# Explainers of the first seed of two sources under the controls, and what is made of what they say.
CONTROLS_SHOWN = jobs("control_metrics", "control_intervals", "control_severities")
CONTROLS_SHOWN += jobs("table10_controls", "table10_transfer", "table10_costs", "severity_curves", "transfer")
CONTROLS = jobs(explain_controls=2) + CONTROLS_SHOWN
# With other methods and estimators beneath them: explainers of one source.
EXCHANGED = jobs("explain_exchanged", "exchange_metrics", "table14_estimator_explanations", "table14_method_matrix")
GRADIENTS_SHOWN = jobs("gradient_metrics", "saliency", "saliency_deletion", "tcav")
GRADIENTS = jobs(follow_gradients=2) + GRADIENTS_SHOWN
READINGS_SHOWN = jobs("readings", "table13_readings")
# Explainers times two sources: three with a GPC (on the frames classic features and the pair too), four on embeddings,
# 11 on uncertainties.
WITH_GPC, ON_EMBEDDINGS, ON_UNCERTAINTY = (jobs(attribute=n) for n in (2 * 3 + 2, 2 * 4, 2 * 11))
PRETRAINED = jobs("pretrain_encoder", "reduce_embeddings", train_on_frames=2)


def test_a_table_asked_for_alone_needs_no_figure_and_no_other_explainer(project):
    (project.folder / "baselines/lazy.py").write_text(
        "from gpca.explainers.gpca import GPCA\nfrom gpca.explainers.interface import ExplainerEntry\n"
        "EXPLAINERS = {'lazy': ExplainerEntry('Lazy', GPCA)}\n"
    )
    project.append("config/smoke.yaml", "  lazy: {}\n")
    table1, table2 = (f"results/smoke/tables/table{name}.md" for name in ("1_single_baselines", "2_per_concept"))
    planned = project.dry_run(table1, table2, "--configfile", "config/smoke.yaml")
    assert planned.before(table2) == {
        "sample_objects": 2, "register": 4, "train_encoder": 4, "embed": 4, "attribute": 4, "table2_per_concept": 1
    }  # fmt: skip
    assert planned.before(table1)["attribute"] == 8
    assert planned.before(table1)["run_icp"] == 2
    for unneeded in ("lazy", "figures", "removal"):
        assert not [path for path in planned.outputs if unneeded in path]


def test_table3_needs_no_uncertainty_and_no_explainer(planned):
    assert planned.before("results/smoke/tables/table3_active_learning.md") == {
        "sample_objects": 2, "register": 4, "train_encoder": 4, "embed": 4, "embed_without": 4, "learn_actively": 4,
        "active_learning": 1, "table3_active_learning": 1,
    }  # fmt: skip


def test_table15_needs_the_causes_and_the_encoders_of_other_seeds_and_sources(planned):
    before = planned.before("results/smoke/tables/table15_new_concepts.md")
    assert before["learn_new_concepts"] == before["sample_causes"] == before["train_on_causes"] == 2
    assert before["train_encoder"] == before["learn_actively"] == 4
    assert not {"attribute", "diagnose", "explain_controls", "run_icp"} & set(before)


def test_table4_needs_its_sources_alone_and_table5_no_explainer(planned):
    assert planned.before("results/smoke/tables/table4_kernels.md") == {
        "sample_objects": 1, "register": 2, "train_encoder": 2, "embed": 2, "fit_kernel_grid": 1, "table4_kernels": 1,
    }  # fmt: skip
    assert planned.before("results/smoke/tables/table5_learners.md") == {
        "sample_objects": 2, "register": 4, "train_encoder": 4, "embed": 4, "shift": 2, "fit_learners": 2,
        "diagnostics": 1, "table5_learners": 1,
    }  # fmt: skip


def test_table6_needs_the_frames_and_what_the_encoder_starts_from(planned):
    assert planned.before("results/smoke/tables/table6_backbones.md") == {
        "sample_objects": 2, "register": 2, "pretrain_encoder": 1, "render_scenes": 1, "instances": 1,
        "register_frames": 2, "train_on_frames": 2, "embed": 2, "reduce_embeddings": 1, "attribute": 4, "real_world": 1,
        "learn_on_frames": 1, "table6_backbones": 1,
    }  # fmt: skip


def test_table11_needs_the_registrations_alone(planned):
    assert planned.before("results/smoke/tables/table11_registration.md") == {
        "sample_objects": 2, "register": 4, "register_methods": 2, "registration_methods": 1, "table11_registration": 1,
    }  # fmt: skip


def test_table12_needs_the_causes_alone(planned):
    assert planned.before("results/smoke/tables/table12_uncertainty.md") == {
        "sample_objects": 2, "sample_causes": 4, "estimate": 2, "estimator_metrics": 1, "table12_uncertainty": 1,
    }  # fmt: skip


def test_table14_needs_one_source_and_its_encoders(planned):
    assert planned.before("results/smoke/tables/table14_method_matrix.md") == {
        "sample_objects": 1, "register": 1, "train_encoder": 1, "explain_exchanged": 1, "exchange_metrics": 1,
        "table14_method_matrix": 1,
    }  # fmt: skip


def test_table7_needs_the_model_alone_and_table8_only_itself(planned):
    assert planned.before("results/smoke/tables/table7_runtime.md") == {
        "render_scenes": 1, "instances": 1, "register_frames": 1, "embed": 1, "model": 1,
        "register": 2, "pretrain_encoder": 1, "train_on_frames": 1,
        "sample_objects": 2, "sample_model_causes": 2, "describe_model_causes": 2,
        "time_stages": 1, "table7_runtime": 1,
    }  # fmt: skip
    assert planned.before("results/smoke/tables/table8_recovery.md") == {
        "recover": 2, "recovery": 1, "table8_recovery": 1,
    }  # fmt: skip


EDITS = {
    "gpca/classifier/gpc.py": WITH_GPC + COLLECTORS + jobs("table1_single_baselines", "table2_per_concept")
    + jobs(learn_actively=4) + LEARNED + DIAGNOSED + KERNELS + BACKBONES + MODEL + RECOVERY + METHOD
    + jobs(diagnose=4) + CAUSES_SHOWN + CONTROLS + EXCHANGED + NEW + GRADIENTS,
    "gpca/shift/samples.py": jobs(shift=2) + DIAGNOSED,
    "baselines/heads.py": DIAGNOSED,
    "gpca/reporting/figures/kernel_grid.py": jobs("kernel_learning_curves"),
    "gpca/active_learning/acquisition.py":
        jobs("fig4_pipeline", learn_actively=4) + LEARNED + NEW + RUNTIME + LABELLED,
    "gpca/active_learning/stream.py": jobs("fig4_pipeline", learn_actively=4) + LEARNED,
    "gpca/reporting/figures/active_learning.py":
        jobs("active_learning_curves", "active_learning_overlap", "new_concept_curves", "fig4_pipeline"),
    # Not Table II: it shows GP-CA alone.
    "gpca/alignment/icp_kernels.py":
        jobs("table1_single_baselines", run_icp=10) + ON_UNCERTAINTY + COLLECTORS + MODEL + RECOVERY + CAUSES
        + MODEL_CAUSES + METHOD + jobs(register_methods=2, estimate=2) + METHODS + ESTIMATED + CONTROLS + EXCHANGED
        + NEW + NEW_SHOWN,
    "gpca/alignment/methods/teaser.py": jobs(register_methods=2) + METHODS,
    "gpca/reporting/tables/registration.py": jobs("table11_registration", "table11_severity"),
    "baselines/softmax_head.py": jobs(attribute=2, diagnose=2) + COLLECTORS + RECOVERY + CAUSES_SHOWN + CONTROLS,
    "gpca/reporting/figures/contact_sheet.py": jobs("objects_coffee_cup", "objects_ycb"),
    "gpca/reporting/figures/concepts.py": jobs("fig3_concepts", "fig5_real_world_example") + METHOD,
    # Not the pictures: they show an encoder without reduction.
    "gpca/encoders/reduction.py": jobs("reduce_embeddings", "attribute") + FRAMES,
    "gpca/frames/occlusion.py": jobs("reduce_embeddings", register_frames=2, train_on_frames=2, embed=2, attribute=2)
    + BACKBONES + MODEL,
    "gpca/frames/bop.py":
        jobs("reduce_embeddings", "instances", register_frames=2, train_on_frames=2, embed=2, attribute=2)
        + jobs("render_scenes") + BACKBONES + MODEL + RECOVERY + ON_FRAMES,
    "gpca/recovery/policy.py": MODEL + RECOVERY,
    "gpca/reporting/tables/explainers.py": TABLES1,
    "gpca/reporting/figures/confusions.py":
        jobs("fig_attribution_confusions", "confusion_real_world", "cause_confusions"),
    "gpca/encoders/dgcnn.py": PRETRAINED + jobs(train_encoder=4, embed=6, embed_without=4, learn_actively=4)
    + jobs("table1_single_baselines", "table2_per_concept", shift=2) + BACKBONES + ON_EMBEDDINGS + COLLECTORS
    + LEARNED + DIAGNOSED + KERNELS + MODEL + RECOVERY + METHOD
    + jobs(train_on_causes=4, diagnose=2, train_control=2) + CAUSES_SHOWN + CONTROLS + EXCHANGED + NEW + GRADIENTS,
    "gpca/objects/uw_rgbd.py": jobs(),
    "gpca/objects/shapes/cups.py": jobs("sample_objects", "objects_coffee_cup", "fig3_concepts")
    + jobs("table1_single_baselines", "table2_per_concept", register=2, train_encoder=2, embed=4, run_icp=5)
    + PRETRAINED + BACKBONES
    + jobs(attribute=16, embed_without=2, learn_actively=2, shift=2) + COLLECTORS + LEARNED + DIAGNOSED + METHOD
    + jobs(sample_causes=2, describe=2, train_on_causes=2, diagnose=4) + CAUSES_SHOWN
    + jobs(sample_model_causes=1, describe_model_causes=1, train_control=1) + MODEL
    + jobs("register_methods", "estimate", "follow_gradients") + METHODS + ESTIMATED + CONTROLS + NEW + GRADIENTS_SHOWN,
    "gpca/descriptors/entropy.py":
        jobs(describe=4, diagnose=8, describe_model_causes=2, estimate=2) + CAUSES_SHOWN + MODEL + ESTIMATED
        + EXCHANGED + NEW + NEW_SHOWN,
    "gpca/uncertainty/estimators/censi.py": jobs(estimate=2) + ESTIMATED + EXCHANGED,
    "gpca/reporting/figures/estimators.py": jobs("estimators"),
    "baselines/causes/trees.py": jobs(diagnose=2) + CAUSES_SHOWN,
    "gpca/controls/variants.py": jobs(train_control=2) + CONTROLS,
    "gpca/controls/judged.py": CONTROLS_SHOWN,
    "gpca/experiments/exchange/estimated.py": EXCHANGED,
}  # fmt: skip


@pytest.mark.parametrize("module", EDITS)
def test_the_rules_that_use_a_module_depend_on_it_and_no_other(planned, module):
    assert without_ends(planned.behind(module)) == EDITS[module]


@pytest.mark.parametrize("name", ["gpca/reporting/page/findings.py", "gpca/reporting/page/templates/page.js"])
def test_what_the_page_alone_uses_makes_the_page_alone(planned, name):
    assert planned.behind(name) == {"page": 1}


def test_a_group_of_readings_is_run_again_for_its_own_code_alone(planned):
    again = planned.behind("gpca/readings/severities.py")
    assert [again[rule] for rule in ("reading", "reading_values", "comparison", "table13_readings")] == [1, 1, 1, 1]


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


def test_a_finished_run_has_nothing_to_do_nor_has_one_with_a_touched_but_unchanged_module(finished):
    (finished.folder / "gpca/classifier/gpc.py").touch()
    assert not finished.dry_run(*SMOKE).jobs
    assert not finished.dry_run("smoke").jobs


def test_a_changed_setting_reruns_what_depends_on_it(finished):
    (finished.folder / "mine.yaml").write_text(json.dumps({"explainers": {"gpca": {"iterations": 21}}}))
    planned = finished.dry_run(*SMOKE, "mine.yaml")
    assert without_ends(planned.jobs) == (
        jobs("table1_single_baselines", "table2_per_concept", attribute=2)
        + COLLECTORS + DIAGNOSED + BACKBONES + MODEL + RECOVERY + METHOD + GRADIENTS - jobs("learn_on_frames")
    )  # fmt: skip
    assert not [path for path in planned.outputs if "predictions/" in path and "gpca_paper" in path]


def test_a_figure_of_another_source_is_drawn_alone(finished):
    (finished.folder / "mine.yaml").write_text(json.dumps({"figures": {"source": "ycb"}}))
    assert (
        finished.dry_run(*SMOKE, "mine.yaml").jobs
        == jobs("fig3_concepts", "causes_example", "estimators", "saliency", "page") + METHOD
    )


def test_every_table_figure_and_stage_is_a_target_by_name(project):
    names = ("table5", "reliability", "objects", "paper")
    planned = project.dry_run(*names, "--configfile", "config/smoke.yaml")
    inputs = {rule: files for rule, files, _ in planned.plan if rule in names}
    assert inputs["table5"] == {"results/smoke/tables/table5_learners.md"}
    assert "results/smoke/figures/reliability.pdf" in planned.outputs
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
