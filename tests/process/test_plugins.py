"""Code from outside: files and modules that a config names, and installed packages that announce themselves."""

import sys

import pytest

from gpca.active_learning.acquisition import strategies
from gpca.config.check import check
from gpca.encoders.registry import encoders
from gpca.errors import InputError
from gpca.experiments.run import names_of
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module, explainers
from gpca.process.code_files import code_files
from gpca.process.plugins import load, named, use
from gpca.process.registry import load as load_member

from ..config.configs import load as load_config

EXPLAINER = """
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer


class Own(ScoringExplainer):
    def __init__(self, source, seed, width: int = 3):
        pass


EXPLAINERS = {"own": ExplainerEntry("Own", Own, ("pair",))}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch, apart):
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(folder, files):
    for name, text in files.items():
        path = folder / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)


def announce(folder, monkeypatch, package, groups):
    """Make a package that lies in a folder an installed one."""
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    lines = [f"[{group}]\n{package} = {module}\n" for group, module in groups.items()]
    (info / "entry_points.txt").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(folder)


def test_a_file_that_a_config_names_is_checked_named_and_its_code_is_an_input(folder):
    write(folder, {"my_own": EXPLAINER})
    config = load_config() | {"plugins": ["my_own.py"]}
    config["explainers"]["own"] = {"width": 4}
    sources = check(config)
    assert "own" in names_of(config, sources)["explainer"]
    assert explainer_module("own") == "my_own"
    files = code_files("gpca.steps.pairs:attribute", explainer_module("own"))
    assert "my_own.py" in files and any(file.endswith("gpca/explainers/interface.py") for file in files)
    config["explainers"]["own"] = {"widths": 4}
    with pytest.raises(InputError, match=r"config key explainers\.own: explainer 'own': setting widths: unknown"):
        check(config)


def test_without_the_config_the_name_is_unknown(folder):
    write(folder, {"my_own": EXPLAINER})
    use(["my_own.py"])
    assert "own" in explainers()
    use([])
    with pytest.raises(InputError, match="explainer 'own': unknown"):
        explainer_entry("own")


def test_a_module_is_found_below_the_working_directory(folder):
    write(folder, {"lab/__init__": "", "lab/explainers": EXPLAINER.replace("EXPLAINERS", "CAUSE_EXPLAINERS")})
    use(["lab.explainers"])
    assert named() == ["lab.explainers"]
    assert explainer_entry("own", CAUSES).title == "Own" and "own" not in explainers()
    files = code_files("lab.explainers")
    assert {"lab/__init__.py", "lab/explainers.py"} <= set(files)


def test_an_installed_package_is_found_by_its_entry_points_and_only_for_their_groups(folder, monkeypatch):
    installed = folder / "site"
    installed.mkdir()
    text = "from ._net import WIDTH\nENCODERS = {'net': 'lab2.net:Net'}\nSTRATEGIES = {'no': 1}\n"
    files = {"__init__": "", "encoders": text, "_net": "WIDTH = 3\n", "net": "from lab2 import _net\n"}
    write(installed, {f"lab2/{name}": text for name, text in files.items()})
    announce(installed, monkeypatch, "lab2", {"gpca.encoders": "lab2.encoders"})
    assert encoders()["net"] == "lab2.net:Net"
    assert "no" not in strategies()
    assert code_files("lab2.net") == ["site/lab2/__init__.py", "site/lab2/_net.py", "site/lab2/net.py"]
    assert "site/lab2/_net.py" in code_files("lab2.encoders")


def test_what_a_lone_file_imports_from_beside_it_counts_as_its_code(folder):
    method = "import numpy\nimport helper\nMETHODS = {}\n"
    write(folder, {"mine/method": method, "mine/helper": "import other\n", "mine/other": ""})
    use(["mine/method.py"])
    assert code_files("method") == ["mine/helper.py", "mine/method.py", "mine/other.py"]


FAULTS = {
    "missing": ("none.py", "none.py: no such file; give a Python file relative to the working directory, or a module"),
    "no module": ("none.such", r"none.such: cannot be imported \(ModuleNotFoundError: No module named 'none'\)"),
    "raises": ("raises.py", r"raises.py: cannot be imported \(ZeroDivisionError: division by zero\); correct it"),
    "grammar": ("grammar.py", r"grammar.py: cannot be imported \(SyntaxError: .*\); correct it"),
    "empty": ("empty.py", "empty.py: lists nothing that could be used; give it one of EXPLAINERS, CAUSE_EXPLAINERS"),
    "taken": ("statistics.py", "statistics.py: has the name of another module, .*statistics.py; rename it"),
    "hyphen": ("my-own.py", "my-own.py: has a name that Python cannot import; rename it"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_plugin_that_cannot_be_used_is_refused_in_one_line(fault, folder):
    files = {"raises": "1 / 0\n", "grammar": "def f(:\n", "empty": "x = 1\n", "statistics": "EXPLAINERS = {}\n"}
    write(folder, files)
    (folder / "my-own.py").write_text("EXPLAINERS = {}\n")
    plugin, words = FAULTS[fault]
    with pytest.raises(InputError, match=f"config key plugins: {words}"):
        check(load_config() | {"plugins": [plugin]})


@pytest.mark.parametrize("plugins", ["my_own.py", [3], 5])
def test_what_is_no_list_of_names_is_refused(plugins, apart):
    with pytest.raises(InputError, match=r"config key plugins: .* is not a list of files or modules"):
        check(load_config() | {"plugins": plugins})


ENTRIES = {
    "type": ("STRATEGIES = {'mine': 3}", r"own: STRATEGIES\['mine'\] is an int; make it a Strategy"),
    "list": ("STRATEGIES = ['mine']", "own: STRATEGIES is not a mapping; give names, each with its Strategy"),
    "name": (
        "from gpca.active_learning.acquisition import STRATEGIES as own\nSTRATEGIES = {'bald': own['random']}",
        "own: there is another strategy 'bald'; choose a name of your own",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", ENTRIES)
def test_entries_that_no_registry_can_take_are_refused(fault, folder):
    text, words = ENTRIES[fault]
    write(folder, {"own": text})
    use(["own.py"])
    with pytest.raises(InputError, match=words):
        strategies()


def test_a_package_that_cannot_be_imported_is_named(folder, monkeypatch):
    write(folder, {"lab3": "1 / 0\n"})
    announce(folder, monkeypatch, "lab3", {"gpca.methods": "lab3"})
    from gpca.alignment.methods.registry import methods

    with pytest.raises(InputError, match=r"plugin lab3 of the package lab3: cannot be imported \(ZeroDivisionError"):
        methods()


def test_a_file_is_imported_once_and_leaves_nothing_in_its_folder(folder, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    write(folder, {"once": "import beside\nENCODERS = {'own': 'net:Net'}\n", "beside": "", "net": "Net = dict\n"})
    assert load("once.py") is load(str(folder / "once.py")) is sys.modules["once"]
    assert load_member("net:Net") is dict
    assert {path.name for path in folder.iterdir()} == {"once.py", "beside.py", "net.py"}
