"""Which tables and figures there are, by the paper's sections: the order of the page, the categories of the report."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

SECTIONS = {  # section of the paper -> name of a table or figure -> its title
    "III Gaussian process concept attribution": {
        "fig2_overview": "Figure 2: overview",
        "fig4_pipeline": "Figure 4: pipeline",
    },
    "IV-A Datasets and controlled perturbations": {
        "fig3_concepts": "Figure 3: the three concepts",
        "objects": "Objects",
    },
    "IV-B Concept attribution accuracy": {
        "table1_single_baselines": "Table I: accuracy of SHAP, SA and GP-CA",
        "table2_per_concept": "Table II: accuracy per concept",
        "table1_extended": "Table I, extended: every explainer",
        "fig_attribution_confusions": "Confusions of every explainer",
    },
    "IV-C Active learning via BALD": {
        "table3_active_learning": "Table III: labels needed for a new concept",
        "active_learning_curves": "Learning curves",
        "table3_extended": "Table III, extended: every strategy",
        "table3_stream": "Table III on a stream",
    },
    "IV-D Ablation studies": {
        "table4_kernels": "Table IV: kernel and schedule",
        "kernel_learning_curves": "Accuracy and confidence over iterations",
        "table4_grid": "Table IV, extended: every combination",
        "table5_learners": "Table V: learners and the worth of their uncertainty",
        "table5_shift": "Table V under shift",
        "table5_claims": "Table V: the paper's claims",
        "coverage_risk": "Risk over coverage",
        "reliability": "Reliability",
        "uncertainty_vs_distance": "Uncertainty over distance to the training samples",
        "table6_backbones": "Table VI: backbones and reductions",
    },
    "IV-E Real-world validation": {
        "fig5_real_world_example": "Figure 5: from a depth frame to an attribution",
        "confusion_real_world": "Confusions on depth frames",
        "real_world_failures": "Most confident mistakes on depth frames",
        "table7_runtime": "Table VII: runtime per component",
        "runtime": "Runtime per component",
    },
    "V Robotic deployment for action recovery": {
        "fig1_recovery_example": "Figure 1: a failure and its recovery",
        "fig6_mitigation": "Figure 6: from scores to actions",
        "table8_recovery": "Table VIII: recovery by policy",
        "recovery_rates": "Recovery over actions",
    },
}
OTHER = "Further results"  # a table or figure that is not listed above is still shown
_OBJECTS = "objects_"  # one figure for each source


def section_of(name: str) -> str:
    """Return the section that a table or figure belongs to, `OTHER` if it is not listed."""
    return next((section for section, titles in SECTIONS.items() if listed_as(name) in titles), OTHER)


def title_of_result(name: str) -> str:
    """Return what a table or figure is called; one that is not listed has its own name."""
    titles = {key: title for of_section in SECTIONS.values() for key, title in of_section.items()}
    title = titles.get(listed_as(name), name)
    return f"{title}: {name.removeprefix(_OBJECTS)}" if name.startswith(_OBJECTS) else title


def listed_as(name: str) -> str:
    """Return the name under which a table or figure is listed and captioned: ``objects`` for ``objects_ycb``."""
    return _OBJECTS.rstrip("_") if name.startswith(_OBJECTS) else name


def by_section(names: Iterable[str]) -> dict[str, list[str]]:
    """Return section -> those of the names that belong to it, both in the order above; no section without any."""
    order = [key for titles in SECTIONS.values() for key in titles]
    sections: dict[str, list[str]] = {}
    for section in (*SECTIONS, OTHER):
        of_section = [name for name in names if section_of(name) == section]
        if of_section:
            sections[section] = sorted(
                of_section, key=lambda name: order.index(listed_as(name)) if listed_as(name) in order else len(order)
            )
    return sections


def caption_files(folder: str | Path, names: Iterable[str]) -> list[str]:
    """Return the caption of each table and figure, reStructuredText in a folder, each file once."""
    return list(dict.fromkeys(f"{folder}/{listed_as(name)}.rst" for name in names))
