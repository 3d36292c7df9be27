"""The source files that a step depends on, and one file by which its rule does: Snakemake tracks no imports."""

import ast
import hashlib
import os
from functools import cache
from pathlib import Path
from uuid import uuid4

from gpca.io.files import sha256_of_file
from gpca.process.plugins import ROOTS, lone_root

ROOT = Path(__file__).resolve().parents[2]  # of both packages: a checkout, or site-packages
PACKAGES = ("gpca", "baselines")
FOLDER = Path(".snakemake/code")  # of stamps, beside what Snakemake remembers of the files that it made
BESIDE = {  # files that a module reads from its folder
    "gpca.comparison.claims": "claims.yaml",
    "gpca.comparison.published": "*.csv",
    "gpca.reporting.figures.style": "matplotlibrc",
    "gpca.experiments.reading_words": "reading_words.csv",
    "gpca.experiments.scans": "published_scans.csv",
    "gpca.page.page": "templates/*",
    "gpca.model.scene": "assets/*",
}


def code_files(*modules: str) -> list[str]:
    """Return the files of modules and of all project modules that they import, and their files in `BESIDE`; sorted.

    For ``module:function``, only the imports that the function needs count. A plugin counts with its imports from its
    package or, if it is a single file, from its folder. Paths are relative where they are below the working directory.
    Modules that are chosen by name at run time (kinds of source, encoders, explainers) must be given.
    """
    reached: dict[str, str] = {}  # module -> its file
    open_modules = list(modules)
    while open_modules:
        module = open_modules.pop()
        if module not in reached:
            reached[module], imported = _imports(module)
            open_modules += imported
    files = {*reached.values()}
    files |= {str(file) for name in BESIDE.keys() & reached for file in Path(reached[name]).parent.glob(BESIDE[name])}
    working = Path.cwd().resolve()  # as ROOT is
    seen = str(ROOT.relative_to(working) / "_")[:-1] if ROOT.is_relative_to(working) else f"{ROOT}/"
    prefixes = {f"{ROOT}/": seen, f"{working}/": ""}  # where files are -> what their names begin with
    inside = {file: next((folder for folder in prefixes if file.startswith(folder)), "") for file in files}
    return sorted(prefixes.get(at, "") + file.removeprefix(at) for file, at in inside.items())


_STATEMENTS = ("body", "orelse", "finalbody", "handlers", "cases")  # where a statement holds others, as imports are


@cache
def _imports(module: str) -> tuple[str, tuple[str, ...]]:
    module, _, function = module.partition(":")
    if (file := _file(module)) is None:
        raise ModuleNotFoundError(f"there is no module {module}")
    names = _names(file, module, function)
    top = module.split(".")[0]
    if top not in PACKAGES:  # the packages around it run first
        names |= {module.rsplit(".", depth)[0] for depth in range(1, module.count(".") + 1)}
        if (folder := lone_root(top)) is not None:  # of a plugin that is a file, with modules beside it
            for first in {name.split(".")[0] for name in names} - {*PACKAGES}:
                if (folder / f"{first}.py").is_file() or (folder / first).is_dir():
                    ROOTS.setdefault(first, folder)
    followed = (name for name in names if _is_followed(name, top) and _file(name) is not None)
    return str(file), tuple(sorted(followed))


def _names(file: Path, module: str, function: str) -> set[str]:
    """Return all that a module imports, or that its function needs."""
    names: set[str] = set()
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes: list[ast.AST] = _statements_for(tree, function) if function else [tree]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            nodes += node.orelse
        else:
            nodes += (child for part in _STATEMENTS for child in getattr(node, part, ()))
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            package = module.split(".") if file.stem == "__init__" else module.split(".")[:-1]
            around = package[: len(package) - (node.level - 1)] if node.level else []  # of a relative import
            base = ".".join([*around, *([node.module] if node.module else [])])
            names |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return names


def _statements_for(tree: ast.Module, function: str) -> list[ast.AST]:
    """Return a function of a module, and the module's statements that bind the names that it uses, and so on."""
    binding: dict[str, ast.stmt] = {}
    for node in tree.body:
        names = {node.name} if isinstance(node, (ast.FunctionDef, ast.ClassDef)) else _used_and_bound(node)[1]
        binding |= dict.fromkeys(names, node)
    if function not in binding:
        raise AttributeError(f"the module has no function {function}")
    statements: dict[ast.AST, None] = {}
    open_names = [function]
    while open_names:
        needed = binding.get(open_names.pop())
        if needed is None or needed in statements:
            continue
        statements[needed] = None
        used, bound = _used_and_bound(needed)
        open_names += used - bound
    return list(statements)


def _used_and_bound(node: ast.AST) -> tuple[set[str], set[str]]:
    """Return the names that a statement reads, and those that it binds."""
    used: set[str] = set()
    bound: set[str] = set()
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            (used if isinstance(part.ctx, ast.Load) else bound).add(part.id)
        elif isinstance(part, (ast.Import, ast.ImportFrom)):
            bound |= {alias.asname or alias.name.split(".")[0] for alias in part.names}
        elif isinstance(part, ast.arg):
            bound.add(part.arg)
    return used, bound


def _is_followed(name: str, importing: str) -> bool:
    first = name.split(".")[0]
    if first in PACKAGES or first == importing:
        return True
    return importing not in PACKAGES and lone_root(importing) is not None and ROOTS.get(first) == lone_root(importing)


@cache
def _file(module: str) -> Path | None:
    first = module.split(".")[0]
    path = (ROOT if first in PACKAGES else ROOTS.get(first, ROOT)).joinpath(*module.split("."))
    return next((each for each in (path.with_suffix(".py"), path / "__init__.py") if each.is_file()), None)


@cache
def code_stamp(*modules: str) -> str:
    """Write the names and hashes of all :func:`code_files` of modules, and return the file that holds them.

    It changes with them, not when one is merely touched; at first it is as old as the newest, to keep what was made.
    """
    files = code_files(*modules)
    text = "".join(f"{_sha256(file)}  {file}\n" for file in files)
    # In a folder of its own: Snakemake looks into a folder once, and takes what is not yet there to be missing.
    folder = FOLDER / hashlib.sha256(repr(modules).encode()).hexdigest()[:12]
    stamp = folder / modules[0].replace(":", ".")
    is_known = stamp.exists()
    if not is_known or stamp.read_text(encoding="utf-8") != text:
        folder.mkdir(parents=True, exist_ok=True)
        partial = folder / uuid4().hex  # jobs on other machines may write it at the same time
        partial.write_text(text, encoding="utf-8")
        if not is_known:
            time_ns = max(os.stat(file).st_mtime_ns for file in files)
            os.utime(partial, ns=(time_ns, time_ns))
        partial.replace(stamp)
    return str(stamp)


_sha256 = cache(sha256_of_file)
