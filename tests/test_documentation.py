"""The documentation does what it says: links, commands, examples and numbers are checked against the project."""

import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from snakemake.utils import update_config

from gpca.__main__ import STEPS
from gpca.reporting.kernel_tables import KERNEL_TABLES
from gpca.reporting.learner_figures import LEARNER_FIGURES
from gpca.reporting.learner_tables import LEARNER_TABLES
from gpca.reporting.learning_tables import LEARNING_TABLES

ROOT = Path(__file__).resolve().parents[1]
NOT_OURS = {"__pycache__", "data", "build"}
# Hosts that our own files may name; those of data sets stand in the config alone.
LITERATURE = {"arxiv.org", "github.com", "pointclouds.org", "json-schema.org"}
DATA = {"rgbd-dataset.cs.washington.edu", "huggingface.co"}


def our_files():
    """All text files of the project; of results/ only what git keeps, of hidden ones .ci/ and .gitignore."""
    for folder, folders, names in os.walk(ROOT):
        here = Path(folder).relative_to(ROOT)
        kept = {"reference"} if here == Path("results") else set(folders) - NOT_OURS
        folders[:] = sorted(name for name in folders if name in kept and (name[0] != "." or name == ".ci"))
        for name in sorted(name for name in names if name[0] != "." or name == ".gitignore"):
            path = Path(folder, name)
            if path.suffix not in {".png", ".pdf", ".npz", ".pt", ".log"}:
                yield path


def relative(path):
    return str(path.relative_to(ROOT))


PAGES = [path for path in our_files() if path.suffix == ".md" and "reference" not in path.parts]


def code_in(text):
    """Command lines in fenced blocks, without their comments, and spans of code in the running text."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines = [line.split("  #")[0].strip() for block in blocks for line in block.splitlines()]
    return [code for code in (*lines, *re.findall(r"`([^`\n]+)`", prose)) if code and not code.startswith("#")]


def commands(program):
    found = {(relative(page), code) for page in PAGES for code in code_in(page.read_text()) if code.startswith(program)}
    assert found, f"no page names a command of {program}"
    return sorted(found)


def blocks_of(page):
    """Fenced blocks whose first line names the file they belong to, in order: (file, text)."""
    fenced = re.findall(r"^```\w+\n# (\S+\.\w+)\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    assert fenced
    return fenced


def block(file, containing):
    [text] = [text for name, text in blocks_of("docs/adding.md") if name == file and containing in text]
    return text


# --- links, commands, numbers ---


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_every_relative_link_leads_to_a_file(page):
    links = re.findall(r"\[[^\]]*\]\(([^)\s]+)\)", page.read_text())
    local = [link.split("#")[0] for link in links if not link.startswith(("http://", "https://", "#"))]
    assert [link for link in local if not (page.parent / link).exists()] == []


@pytest.mark.parametrize(("page", "command"), commands("make "))
def test_every_make_target_exists(page, command):
    targets = [word for word in shlex.split(command)[1:] if "=" not in word]
    known = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert targets
    assert set(targets) <= set(known)


@pytest.mark.parametrize(("page", "command"), commands("python "))
def test_every_python_command_names_something_that_is_there(page, command):
    words = shlex.split(command)[1:]
    if words[0] != "-m":
        assert (ROOT / words[0]).is_file()
        flags = {word.split("=")[0] for word in words[1:] if word.startswith("--")}
        help_text = subprocess.run([sys.executable, words[0], "--help"], cwd=ROOT, capture_output=True, text=True)
        assert all(flag in help_text.stdout for flag in flags)
    elif words[1] == "gpca":
        assert words[2] in STEPS or words[2].startswith(("-", "<"))
    else:
        assert find_spec(words[1]) is not None


@pytest.mark.parametrize(("page", "command"), commands("snakemake "))
def test_every_snakemake_command_can_be_planned(page, command, tmp_path):
    words = [word.replace("data_dir=/data", f"data_dir={tmp_path}") for word in shlex.split(command)[1:]]
    plan = subprocess.run(
        [sys.executable, "-m", "snakemake", *words, "--dry-run", "--quiet"], cwd=ROOT, capture_output=True, text=True
    )
    assert plan.returncode == 0, plan.stderr


@pytest.mark.parametrize(
    ("page", "fewest"), [("protocol", 15), ("baselines", 7), ("diagnostics", 7), ("explain", 3), ("comparison", 14)]
)
def test_every_number_of_the_protocol_is_that_of_the_config(page, fewest):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    rows = re.findall(r"^\| `([a-z0-9_.%]+)` \| `([^`]+)` \|", (ROOT / f"docs/{page}.md").read_text(), re.MULTILINE)
    assert len(rows) >= fewest
    for key, documented in rows:
        value = config
        for part in key.split("."):
            value = value[part]
        assert yaml.safe_load(documented) == value, key


def test_every_configured_rival_is_described():
    explainers = yaml.safe_load((ROOT / "config/config.yaml").read_text())["explainers"]
    page = (ROOT / "docs/baselines.md").read_text()
    for name in set(explainers) - {"gpca", "gpca_paper"}:
        assert f"`{name}`" in page or f"`…{name.removeprefix('shap_removal').removeprefix('sa_local_removal')}`" in page


def test_every_configured_learner_is_described():
    learners = yaml.safe_load((ROOT / "config/config.yaml").read_text())["learners"]
    page = (ROOT / "docs/diagnostics.md").read_text()
    assert [name for name in learners if f"`{name}`" not in page] == []


def test_every_key_of_a_source_is_described():
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    keys = schema["$defs"]["source"]["properties"]
    described = {name for row in re.findall(r"^\| (`.+?) \|", (ROOT / "docs/adding.md").read_text(), re.MULTILINE)
                 for name in re.findall(r"`(\w+)`", row)}  # fmt: skip
    assert described == set(keys)


def test_every_table_and_figure_of_the_readme_is_made():
    listed = re.findall(r"^\| `(tables|figures)/([a-z0-9_]+)", (ROOT / "README.md").read_text(), re.MULTILINE)
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk"))
    by_name = {*LEARNING_TABLES, *KERNEL_TABLES, *LEARNER_TABLES, *LEARNER_FIGURES}
    assert {kind for kind, _ in listed} == {"tables", "figures"}
    for kind, name in listed:
        assert f'"{name}"' in rules or f"/{kind}/{name}" in rules or name in by_name, name


# --- nothing of one machine ---


def test_no_file_names_a_machines_path_a_registry_or_an_unknown_host():
    found = []
    for path in our_files():
        name, text = relative(path), path.read_text(encoding="utf-8")
        found += [
            (name, match) for match in re.findall(r"(?<![\w.~>}])/(?:home|root|Users|work|mnt|scratch)/\w+", text)
        ]
        found += [
            (name, match) for match in re.findall(r"\b(?:pypi|pythonhosted|anaconda|pytorch)\.(?:org|com)\b", text)
        ]
        allowed = LITERATURE | (DATA if name == "config/real.yaml" else set())
        hosts = set() if name.startswith("tests/") else set(re.findall(r"https?://([\w.-]+)", text))
        found += [(name, host) for host in sorted(hosts - allowed)]
    assert found == []


# --- the examples of docs/adding.md ---


@pytest.fixture
def config():
    """The embedded default, as Snakemake puts it together."""
    merged = {}
    for name in ("sources", "config"):
        update_config(merged, yaml.safe_load((ROOT / f"config/{name}.yaml").read_text()))
    return merged


@pytest.fixture
def added_modules(tmp_path, monkeypatch):
    """Put an example's module beside its siblings without writing into the project."""
    names = []

    def add(file, containing=""):
        path = tmp_path / file
        path.parent.mkdir(parents=True)
        path.write_text(block(file, containing))
        package = importlib.import_module(".".join(Path(file).parent.parts))
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(path.parent)])
        importlib.invalidate_caches()
        names.append(".".join(Path(file).with_suffix("").parts))
        return importlib.import_module(names[-1])

    yield add
    for name in names:
        sys.modules.pop(name, None)


def test_a_dataset_by_an_entry(config, tmp_path):
    import trimesh

    from gpca.config import check
    from gpca.objects.source import surfaces

    (tmp_path / "my_parts").mkdir()
    trimesh.creation.box((40, 50, 60)).export(tmp_path / "my_parts" / "brick.stl")
    update_config(config, yaml.safe_load(block("config/sources.yaml", "my_parts")))
    entry = check(config | {"data_dir": str(tmp_path)})["my_parts"]
    assert entry["stand_in"] is False
    [surface] = surfaces(entry, tmp_path)
    assert surface.name == "brick"
    assert surface.vertices_m.max() == pytest.approx(0.03)


def test_a_dataset_by_a_rule_of_its_own(tmp_path):
    from gpca.objects.canonical import ObjectClouds

    for name in ("Snakefile", "environment.lock"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("workflow", "config", "profiles", "gpca", "baselines"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file, text in blocks_of("docs/adding.md"):
        if "torus" in file:
            (tmp_path / file).parent.mkdir(exist_ok=True)
            (tmp_path / file).write_text(text)

    def snakemake(*arguments):
        command = [sys.executable, "-m", "snakemake", "--configfile", "config/smoke.yaml", *arguments]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SNAKEMAKE")}
        run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        return run.stdout + run.stderr

    snakemake("-j1", "results/smoke/objects/torus.npz")
    torus = ObjectClouds.load(tmp_path / "results/smoke/objects/torus.npz")
    assert torus.names == ("torus",)
    assert torus.diameters_m[0] == pytest.approx(0.11, rel=0.01)
    assert "results/smoke/predictions/torus/gpca/seed0.csv" in snakemake("--dry-run", "results/smoke/metrics.csv")


def test_an_explainer(config, added_modules, registrations, tmp_path):
    import numpy as np
    import pandas as pd

    from gpca.config import check
    from gpca.explainer import explainer_entry
    from gpca.predictions import write_predictions

    added_modules("baselines/nearest_quality.py")
    update_config(config, yaml.safe_load(block("config/config.yaml", "nearest_quality")))
    check(config)
    explainer = explainer_entry("nearest_quality").make("tiny", 0, **config["explainers"]["nearest_quality"])
    explainer.fit(registrations.subset(registrations.rows("train")))
    attribution = explainer.explain(registrations.without_labels())
    np.testing.assert_allclose(attribution.scores_N_C.sum(axis=1), 1)
    write_predictions(tmp_path / "predictions.csv", registrations, attribution)
    rows = pd.read_csv(tmp_path / "predictions.csv")
    assert (rows["concept_predicted"] == rows["concept_true"]).mean() > 0.5  # chance is a third


def test_an_encoder(config, added_modules, registrations, monkeypatch):
    import numpy as np

    from gpca.config import check
    from gpca.encoders import registry
    from gpca.encoders.training import EncoderSettings, embed, train_encoder

    added_modules("gpca/encoders/pointwise.py")
    monkeypatch.setattr(registry, "ENCODERS", dict(registry.ENCODERS))
    exec(block("gpca/encoders/registry.py", "pointwise"), {"ENCODERS": registry.ENCODERS})
    update_config(config, yaml.safe_load(block("config/config.yaml", "pointwise")))
    check(config)
    assert config["embedding"]["encoder"] in config["encoders"]
    settings = EncoderSettings(**config["encoders"]["pointwise"] | {"epochs": 1, "points": 64})
    model, curve = train_encoder(registrations, "tiny", 0, settings)
    assert len(curve) == 1
    h_S_d, _ = embed(model, registrations, "tiny", 0, settings)
    assert h_S_d.shape == (len(registrations), 128)
    assert np.isfinite(h_S_d).all()
