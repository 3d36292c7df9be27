"""The path of the model to use. No model is opened here, so no heavy library is needed."""

from __future__ import annotations

import os
from pathlib import Path

from gpca.errors import InputError
from gpca.io.limits import require_file

VARIABLE = "GPCA_MODEL"  # this variable of the environment names the file to take where no other is named
RESULTS = Path("results")  # of the working directory: the package may be installed far from any results
SHIPPED = Path(__file__).with_name("shipped.pt")  # comes with the package where `python -m gpca ship` has put it
BEST_FIRST = ("full", "default")  # runs whose model is preferred; that of the smoke run knows next to nothing
REMEDY = "make one with 'make results', or by itself with 'snakemake -j2 results/default/model.pt'"


def require_model(path: str | Path) -> None:
    """Raise an InputError unless there is a file that can be read; whether it is a model, only loading it shows."""
    require_file(path, "no such model", REMEDY)


def model_path(chosen: str | Path | None = None, results: Path = RESULTS) -> Path:
    """Return the path to use: the given one, that of the environment, one that the workflow made, or `SHIPPED`.

    Of those in `results`, by default the folder of that name in the working directory, that of the run ``full`` comes
    first, then ``default``, then the newest of any other, and ``smoke`` last.

    Raises:
        InputError: there is none.
    """
    if chosen is not None:
        return Path(chosen)
    if named := os.environ.get(VARIABLE):
        if not Path(named).is_file():
            raise InputError(f"{VARIABLE}={named}", "no such model", f"correct it or {REMEDY}")
        return Path(named)

    def rank(path: Path) -> tuple:
        run = path.parent.name
        preferred = BEST_FIRST.index(run) if run in BEST_FIRST else len(BEST_FIRST)
        return run == "smoke", preferred, -path.stat().st_mtime

    candidates = [*sorted(results.glob("*/model.pt"), key=rank), *([SHIPPED] if SHIPPED.is_file() else [])]
    if not candidates:
        raise InputError(
            "no model", f"none in {results.absolute()}", f"{REMEDY}, or name one with --model or {VARIABLE}"
        )
    return candidates[0]
