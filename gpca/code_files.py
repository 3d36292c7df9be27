"""Which source files a step depends on: Snakemake does not notice edits in imported modules unless they are inputs."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent  # the folder that holds both packages: a checkout, or site-packages
PACKAGES = ("gpca", "baselines")
BESIDE = {  # what a module reads from its own folder
    "gpca.comparison.claims": "claims.yaml",
    "gpca.comparison.published": "*.csv",
    "gpca.reporting.figures.style": "matplotlibrc",
    "gpca.experiments.scans.published": "published.csv",
    "gpca.page.page": "templates/*",
    "gpca.model.shown.page": "assets/*",
}


def code_files(*modules: str) -> list[str]:
    """Return the files of the given modules and of all project modules they import, anywhere in their text.

    What is imported only for type checking never runs, so it does not count; a file in `BESIDE` counts with its module.
    Paths are sorted, and lead there from the working directory: relative where the packages lie below it, as in a run
    at the root of a checkout, else absolute. Modules chosen by name at run time (kinds of source, encoders,
    explainers) are not seen and have to be given.
    """
    reached: set[str] = set()
    open_modules = list(modules)
    while open_modules:
        module = open_modules.pop()
        if module not in reached:
            reached.add(module)
            open_modules += _imports(module)
    files = [_file_of(module) for module in reached]
    for module in reached.intersection(BESIDE):
        files += _file_of(module).parent.glob(BESIDE[module])
    working = Path.cwd().resolve()  # as ROOT is
    seen = ROOT.relative_to(working) if ROOT.is_relative_to(working) else ROOT
    return sorted(str(seen / file.relative_to(ROOT)) for file in files)


_HOLD_STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)  # an import is a statement: no need to go into others


@cache
def _imports(module: str) -> tuple[str, ...]:
    names: set[str] = set()
    nodes: list[ast.AST] = [ast.parse(_file_of(module).read_text(encoding="utf-8"))]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            nodes += node.orelse
        else:
            nodes += (child for child in ast.iter_child_nodes(node) if isinstance(child, _HOLD_STATEMENTS))
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return tuple(sorted(name for name in names if name.split(".")[0] in PACKAGES and _file(name) is not None))


def _file_of(module: str) -> Path:
    file = _file(module)
    if file is None:
        raise ModuleNotFoundError(f"no module {module} in {ROOT}")
    return file


def _file(module: str) -> Path | None:
    path = ROOT.joinpath(*module.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None
