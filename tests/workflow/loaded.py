"""What the server behind `tests.workflow.forks` holds when it forks: what plans and jobs load."""

from importlib import import_module

SNAKEMAKE = ("cli", "profiles", "report.html_reporter", "script", "storage", "workflow")
SKLEARN = ("calibration", "cluster", "decomposition", "ensemble", "gaussian_process", "linear_model", "pipeline", "svm")
LIBRARIES = (
    *("gpytorch", "jinja2", "matplotlib.pyplot", "nbformat", "numba", "pandas", "PIL.Image", "pydantic"),
    *("SALib.analyze.sobol", "scipy.ndimage", "scipy.optimize", "scipy.spatial.transform", "scipy.stats", "shap"),
    *("skactiveml.pool", "skactiveml.stream", "torch", "torch._dynamo", "trimesh", "yte"),
)

for module in (*(f"snakemake.{name}" for name in SNAKEMAKE), *(f"sklearn.{name}" for name in SKLEARN), *LIBRARIES):
    import_module(module)
