"""Packages that `gpca explain` does without: small installations lack them, and who needs one is told how to get it."""

from __future__ import annotations

MODULES = {  # extra of pyproject.toml -> the modules of its packages that are imported by name
    "suite": (
        "manifold3d",
        "open3d",
        "PIL",
        "pooch",
        "requests",
        "SALib",
        "shap",
        "shapely",
        "skactiveml",
        "umap",
    ),
    "workflow": ("docutils", "jinja2", "markupsafe", "matplotlib", "snakemake"),
}


def remedy(extra: str) -> str:
    """Return how the packages of an extra are installed."""
    return f"install it, 'pip install \".[{extra}]\"' in the folder of the suite"


def missing(fault: ModuleNotFoundError) -> str | None:
    """Return one line about the package that an import did not find; None where it is in no extra."""
    module = (fault.name or "").partition(".")[0]
    extra = next((name for name, modules in MODULES.items() if module in modules), None)
    return extra and f"{module}: this Python package is not installed; {remedy(extra)}"
