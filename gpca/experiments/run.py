"""What a run consists of, worked out from its configuration: the names in its paths, and what its results show.

The registry of results (:mod:`gpca.reporting.registry`) refers to both by name, as do the rules of the workflow.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from baselines.registry import CAUSES, explainer_entry
from gpca.active_learning.settings import NEW_CONCEPT_STRATEGIES
from gpca.alignment.methods.registry import installed, left_out, method_entry
from gpca.experiments.controls.settings import TRANSFER, UNSEEN
from gpca.experiments.kernel_grid.tables import PRINTED
from gpca.experiments.real_world.tables import CLASSIC, encoder_title
from gpca.experiments.registry import experiments
from gpca.experiments.specification_curve.registry import FRAME_INPUT, GROUPS
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.interface import BARE
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of
from gpca.objects.title import stand_in_clause, title_of
from gpca.recovery.policies import policy_entry
from gpca.uncertainty.estimators.registry import estimator_entry


def names_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what stands in the braces of paths: one value, or the list of all.

    Args:
        config: that :func:`gpca.config.check.check` has checked.
        sources: name -> its resolved entry.
    """
    frames, kernels = config["real_world"], config["kernel_grid"]
    backbones = names_of_backbones(frames)
    return {
        "source": list(sources),
        "seed": list(config["seeds"]),
        "first_seed": str(config["seeds"][0]),
        "method": installed(config["methods"]),
        "estimator": list(config["estimators"]),
        "explainer": list(config["explainers"]),
        "cause_explainer": list(config["diagnosis"]["explainers"]),
        "control_seed": controlled_seeds(config),
        "control": list(config["controls"]["controls"]),
        "control_encoder": _compared_encoders(config["controls"]),
        "timed_control": [name for name in config["controls"]["explainers"] if explainer_entry(name).reads == BARE],
        "transfer_source": list(sources) if transfers(config, sources) else [],
        "gpca": next((name for name in reversed(GPCA_FORMS) if name in config["explainers"]), ""),
        "learner": list(config["learners"]),
        "new_concept_strategy": list(NEW_CONCEPT_STRATEGIES),
        "erring": list(config["new_concepts"]["erring"]),
        "new_concept_seed": new_concept_seeds(config),
        "frame_label_seed": list(config["seeds"])[: config["frame_labels"]["seeds"]],
        "embedding": f"{config['embedding']['encoder']}/{config['embedding']['reduction']}",
        "shown_source": config["figures"]["source"],
        "reading_group": reading_groups(config),
        "frame_input": [name for name in reading_groups(config) if name == FRAME_INPUT],
        "kernel_source": list(kernels["sources"]),
        "printed_kernels": [kernel for kernel, rate, n in PRINTED if _is_fitted(kernels, kernel, rate, n)],
        "frames": REAL_WORLD,
        "backbone": backbones,
        "learning_policy": [name for name in config["recovery"]["policies"] if _learns(name, config["recovery"])],
        "first_backbone": backbones[0],
        "classic": [name for name in CLASSIC if name in config["explainers"]],
        "frame_explainer": list(frames["explainers"]),
        "compared_backbone": list(frames["backbones"])[1:],
        "unreduced": list(unreduced_methods(frames)),
        "condition": [f"{REAL_WORLD}_{name}" for name in conditions_of(config)],
        "condition_backbone": [f"{name}-none" for name in frames["condition_backbones"]],
        "one_encoder": ONE_ENCODER if frames["one_encoder"] else "",
        "frame_cause_seed": list(config["seeds"])[: frames["causes"]["seeds"]],
        **{name: value for each in experiments() for name, value in each.names(config, sources).items()},
    }


def settings_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what tables and figures show besides numbers: titles by name, and conditions of the protocol."""
    frames, recovery, learning = config["real_world"], config["recovery"], config["active_learning"]
    shown = {name: {"title": entry["title"], "stand_in": entry["stand_in"]} for name, entry in sources.items()}
    datasets = {name: _dataset_of(entry) for name, entry in sources.items()}
    of_grid = {name: entry for name, entry in shown.items() if name in config["kernel_grid"]["sources"]}
    of_frames = {"title": frames["title"], "stand_in": not frames["datasets"]}
    of_model = {**shown, REAL_WORLD: of_frames}[config["model"]["source"]]
    entries = {name: explainer_entry(name) for name in config["explainers"]}
    first_reduction = next(iter(frames["reductions"]))
    explainers = {name: entry.title for name, entry in entries.items()}
    learners = {name: explainer_entry(name).title.removesuffix(" on the embedding") for name in config["learners"]}
    own = {name: value for each in experiments() for name, value in each.shown(config, sources).items()}
    return {
        "sources": shown,
        "compared_sources": {**shown, REAL_WORLD: of_frames, ONE_ENCODER: of_frames, "model": of_model},
        "compared_titles": learners | own["strategies"] | explainers,
        "source_titles": {name: title_of(entry) for name, entry in shown.items()},
        "shown_title": title_of(shown[config["figures"]["source"]]),
        "source_datasets": datasets,
        "shown_dataset": datasets[config["figures"]["source"]],
        "recovery_dataset": datasets[recovery["objects"]],
        "frames": of_frames,
        "frame_conditions": {
            REAL_WORLD: _title_of_pose(frames["initial_pose"]),
            **{f"{REAL_WORLD}_{name}": _title_of_pose(entry) for name, entry in conditions_of(config).items()},
        },
        "frame_methods": names_of_backbones(frames),
        "frame_explainers": {name: explainer_entry(name).title for name in frames["explainers"]},
        "frames_title": title_of(of_frames),
        "frames_pretrained_on": _pretrained_on(frames),
        "frames_rendered": bool(frames["virtual"]),
        "model": of_model,
        "model_title": title_of(of_model),
        "methods": {
            name: {"title": entry.title, "is_global": entry.is_global}
            for name in installed(config["methods"])
            for entry in [method_entry(name)]
        },
        "methods_left_out": {method_entry(name).title: of for name, of in left_out(config["methods"]).items()},
        "estimators": {name: estimator_entry(name).title for name in config["estimators"]},
        "estimated_methods": {name: method_entry(name).title for name in config["estimator_pairs"]["methods"]},
        "estimator_pairs": config["estimator_pairs"],
        "global_start": config["method_pairs"]["global_start"],
        "explainers": {name: {"title": entry.title, "oracle": entry.oracle} for name, entry in entries.items()},
        "explainer_titles": explainers,
        "cause_explainers": {name: explainer_entry(name, CAUSES).title for name in config["diagnosis"]["explainers"]},
        "control_explainers": {name: explainer_entry(name).title for name in config["controls"]["explainers"]},
        "controls": list(config["controls"]["controls"]),
        "controls_title": _title_of_all(shown),
        "cause_settings": {**config["causes"], "icp": config["registrations"]["icp"]},
        "learners": learners,
        "reading_groups": {name: GROUPS[name].title for name in reading_groups(config)},
        "new_concepts": {
            **learning,
            **config["new_concepts"],
            "seeds": new_concept_seeds(config),
            "test": config["registrations"]["test"],
            "of_causes": config["causes"],
        },
        "frame_labels": {**learning, **config["frame_labels"], "train": frames["train"], "test": frames["test"]},
        "unreduced_methods": unreduced_methods(frames),
        "frame_encoders": {name: encoder_title(name, "none") for name in frames["backbones"]},
        "test_samples": config["registrations"]["test"],
        "kernel_sources": of_grid,
        "kernel_source_titles": {name: title_of(entry) for name, entry in of_grid.items()},
        "encoder_title": encoder_title(**config["embedding"]),
        "backbones": {name: config["encoders"][name] for name in frames["backbones"]},
        "shown_backbones": [f"{backbone}-{first_reduction}" for backbone in frames["backbones"]],
        "backbone_reductions": list(frames["reductions"]),
        "policies": {name: policy_entry(name, tuple(recovery["actions"])).title for name in recovery["policies"]},
        "recovery_title": f"Tables of the virtual camera, {title_of(shown[recovery['objects']])}",
        "treatments": recovery["treatments"],
        "budget": recovery["loop"]["budget"],
        **own,
    }


def names_of_backbones(frames: Mapping) -> list[str]:
    """Return the rows of Table VI that read embeddings: every encoder with every reduction."""
    return [f"{backbone}-{reduction}" for backbone in frames["backbones"] for reduction in frames["reductions"]]


def _dataset_of(entry: Mapping) -> str:
    """Return what the BOP benchmark calls the dataset that a source's objects are of; empty for other sources."""
    return PurePath(entry.get("location") or "").name if entry.get("kind") == "bop" else ""


def unreduced_methods(frames: Mapping) -> dict[str, str]:
    """Return the titles of what explains frames by a whole embedding, or without one."""
    backbones = [name for name in names_of_backbones(frames) if name.endswith("-none")]
    titles = {name: encoder_title(*name.split("-")) for name in backbones}
    return titles | {name: explainer_entry(name).title for name in frames["explainers"]}


def _pretrained_on(frames: Mapping) -> str:
    """Return what the encoders of frames are trained on before the frames; empty where they are not."""
    if not frames["pretraining"]:
        return ""
    return "whole objects" + (" and on frames rendered of the models of all objects" if frames["virtual"] else "")


def _title_of_pose(settings: Mapping) -> str:
    """Return what a table calls the initial poses of frames."""
    return {"results": "Pose estimators", "true_pose": "True pose, small error"}.get(
        settings.get("form", ""), "Global registration"
    )


def _title_of_all(sources: Mapping[str, Mapping]) -> str:
    """Return the titles of all sources, and whether there are stand-ins among them."""
    titles = ", ".join(entry["title"] for entry in sources.values())
    return titles + stand_in_clause(sources.values())


def controlled_seeds(config: Mapping) -> list[int]:
    """Return the seeds for which the controls are run."""
    return list(config["seeds"])[: config["controls"]["seeds"]]


def new_concept_seeds(config: Mapping) -> list[int]:
    """Return the seeds for which new concepts are learned where no encoder has seen them."""
    return list(config["seeds"])[: config["new_concepts"]["seeds"]]


def transfers(config: Mapping, sources: Mapping) -> bool:
    """Return whether explainers are asked about sources that they did not learn from; one alone admits no transfer."""
    return TRANSFER in config["controls"]["controls"] and len(sources) > 1


def reading_groups(config: Mapping) -> list[str]:
    """Return the groups of readings; one of them trains encoders of depth frames, and is run where there are seeds."""
    groups, frames = config["readings"]["groups"], config["real_world"]
    trains = config["readings"]["frame_seeds"] and "none" in frames["reductions"]
    return [name for name in groups if name != FRAME_INPUT or trains]


def _compared_encoders(controls: Mapping) -> list[str]:
    """Return the ways to train GP-CA's encoder that are compared, on the samples that the unseen objects need."""
    of_gpca = any(name in GPCA_FORMS for name in controls["explainers"])
    return list(controls["encoders"]) if of_gpca and UNSEEN in controls["controls"] else []


def explainer_of(method: str, names: Mapping[str, Any]) -> str:
    """Return the explainer behind a row of predictions: itself, or GP-CA for a ``{backbone}-{reduction}``."""
    return "gpca" if method in names["backbone"] else method


def files_behind(method: str, names: Mapping[str, Any]) -> dict[str, str]:
    """Return what an explainer reads besides the registrations: option of the step ``attribute`` -> pattern of files.

    ``input_timings`` are the seconds that were spent before it starts.
    """
    entry = explainer_entry(explainer_of(method, names))
    encoder, reduction = method.split("-") if method in names["backbone"] else names["embedding"].split("/")
    if entry.reads == "embeddings":
        return {
            "input_timings": f"timings/{{source}}/{encoder}/seed{{seed}}.csv",
            "embeddings": f"embeddings/{{source}}/{encoder}/{reduction}/seed{{seed}}.npz",
        }
    files = {"input_timings": "timings/{source}/icp/seed{seed}.csv"}
    if entry.design:
        files["uncertainty"] = f"uncertainty/{{source}}/{entry.design}/seed{{seed}}.npz"
        files["uncertainty_timings"] = f"timings/{{source}}/uncertainty_{entry.design}/seed{{seed}}.csv"
    return files


def _learns(policy: str, recovery: Mapping) -> bool:
    entry = policy_entry(policy, tuple(recovery["actions"]))
    return entry.learns or entry.queues


def _is_fitted(kernels: Mapping, kernel: str, rate: float, iterations: int) -> bool:
    return kernel in kernels["kernels"] and rate in kernels["learning_rates"] and iterations in kernels["iterations"]
