"""What the server behind `tests.workflow.planning` holds when it forks: what a plan loads, less the suite itself."""

from importlib import import_module

SNAKEMAKE = ("cli", "profiles", "report.html_reporter", "storage", "workflow")
LIBRARIES = ("jinja2", "jsonschema", "nbformat", "PIL.Image", "scipy.spatial.transform", "scipy.stats", "yte")

for module in (*(f"snakemake.{name}" for name in SNAKEMAKE), *LIBRARIES):
    import_module(module)
