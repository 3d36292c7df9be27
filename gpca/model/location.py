"""The path of the model to use; no model is opened, so no heavy library is loaded."""

import os
from pathlib import Path

from gpca.errors import InputError
from gpca.io.files import require_file

VARIABLE = "GPCA_MODEL"  # environment variable with the path of the model
RESULTS = Path("results")  # in the working directory
SHIPPED = Path(__file__).with_name("shipped.pt")  # written by `python -m gpca ship`
REMEDY = "make one with 'make results', or by itself with 'snakemake -j2 results/default/model.pt'"


def require_model(path: str | Path) -> None:
    require_file(path, "no such model", REMEDY)


def model_path(chosen: str | Path | None = None, results: Path = RESULTS) -> Path:
    """Return the given path, that of the environment, the best run's in `results`, `SHIPPED`, or that of ``smoke``."""
    if chosen is not None:
        return Path(chosen)
    if named := os.environ.get(VARIABLE):
        if not Path(named).is_file():
            raise InputError(f"{VARIABLE}={named}", "no such model", f"correct it or {REMEDY}")
        return Path(named)

    def rank(path: Path) -> tuple:
        run = path.parent.name
        return run != "full", run != "default", -path.stat().st_mtime

    smoke = results / "smoke/model.pt"
    runs = sorted(set(results.glob("*/model.pt")) - {smoke}, key=rank)
    candidates = [*runs, *filter(Path.is_file, [SHIPPED, smoke])]
    if not candidates:
        remedy = f"{REMEDY}, or name one with --model or {VARIABLE}"
        raise InputError("no model", f"none in {results.absolute()}", remedy)
    return candidates[0]
