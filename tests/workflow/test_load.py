import re
import shlex
from argparse import ArgumentParser
from copy import deepcopy
from pathlib import Path

import pytest

from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.declarations.registry import results_of
from gpca.experiments.run import names_of

from ..config.configs import load as load_config
from ..documents import commands
from .conftest import ROOT

RULES = sorted((ROOT / "workflow/rules").rglob("*.smk"))


def all_of(patterns):
    """The files of an input of a result, which is one path or a list."""
    return [path for files in patterns.values() for path in ([files] if isinstance(files, str) else files)]


BESIDE_A_CLONE = "gp-ca-bench/config/smoke.yaml my_parts.yaml"
SHOWN = ("my_run.yaml", "fewer.yaml", "my_lab.yaml", BESIDE_A_CLONE)  # on a page: test_tasks.py plans them
CONFIGS = {
    "default": "config/config.yaml", "smoke": "config/smoke.yaml", "full": "config/full.yaml",
    "stand_ins": "config/stand_ins.yaml", "development": "config/development.yaml",
    "bop": "config/full.yaml config/bop.yaml",
}  # fmt: skip


def documented():
    """Targets and `--config` of the `snakemake` commands of all pages by their config files, which are planned once."""
    parser = ArgumentParser()
    parser.add_argument("--configfile", nargs="+", default=["config/config.yaml"])
    for option in ("--config", "--profile", "-j", "-q", "-s", "--report"):  # a report is not made in a dry run
        parser.add_argument(option)
    parser.add_argument("-n", "--report-after-run", action="store_true")
    parser.add_argument("targets", nargs="*")
    found = {}
    for command in commands("snakemake "):
        given = parser.parse_intermixed_args(shlex.split(command)[1:])
        targets = set(given.targets) - {"all"}
        if targets and (files := " ".join(given.configfile)) not in SHOWN:
            assert files in CONFIGS.values() and not given.profile, command
            values, of_files = found.setdefault(files, (set(), set()))
            values.update({given.config} - {None})
            of_files.update(targets)
    return found


DOCUMENTED = documented()


@pytest.mark.parametrize("config", CONFIGS)
def test_every_config_loads_offline_and_asks_for_all_results(project, planned, tmp_path_factory, config):
    """Beside them for what the pages say of that config."""
    files = CONFIGS[config]
    values, targets = DOCUMENTED.get(files, ((), ()))
    values = [value.replace("data_dir=/data", f"data_dir={tmp_path_factory.mktemp('data')}") for value in values]
    if config != "smoke":
        options = ["--config", *values] if values else []
        planned = project.dry_run("all", *sorted(targets), "--configfile", *files.split(), *options)
    assert config != "smoke" or files not in DOCUMENTED
    settings = without_false(load_config(*(Path(file).stem for file in files.split() if config != "default")))
    names = names_of(settings, check(deepcopy(settings)))
    asked = {path for result in results_of(names) for path in (*result.all_files, *all_of(result.files(names)))}
    asked |= {
        f"predictions/{source}/{explainer}/seed{seed}.csv"
        for source in names["source"]
        for explainer in names["explainer"]
        for seed in names["seed"]
    }
    asked |= {"comparison.csv", "tables/claims.csv", "index.html"}
    assert {f"results/{config}/{path}" for path in asked} <= planned.outputs
    assert all(path.startswith(f"results/{config}/") for path in planned.outputs)
    assert ("render_scenes" in planned.jobs) == (config in ("smoke", "stand_ins"))
    # Repeats on depth frames have a job for each kind and backbone, encoders as published one seed.
    published = {path for path in planned.outputs if "predictions/real_rgbd/dgcnn_1024-pca/" in path}
    assert (planned.jobs["repeat_on_frames"], len(published)) == ((12, 1) if "full" in files else (0, 0))
    assert "profiles/default" in planned.messages
    assert not (project.folder / "results").exists()


def test_the_smoke_target_runs_the_smoke_config(project):
    assert project.dry_run("smoke").outputs == {"results/smoke/complete"}


def test_the_snakefile_fits_on_a_page():
    assert len((ROOT / "Snakefile").read_text().splitlines()) <= 60


@pytest.mark.parametrize("path", [path for path in RULES if path.name != "targets.smk"], ids=lambda path: path.name)
def test_every_rule_says_its_environment_and_where_it_logs(path):
    rules = re.split(r"^ *rule\b", path.read_text(), flags=re.MULTILINE)[1:]
    for rule in (rule for rule in rules if re.search("^ *(shell|script):", rule, re.MULTILINE)):
        for keyword in ("log", "benchmark", "conda"):
            assert re.search(rf"^ *{keyword}:", rule, re.MULTILINE), (rule.split(":")[0], keyword)
        assert not re.search("^ *run:", rule, re.MULTILINE)
        # The path of a script, read when its job runs, would be that of the last rule of a loop.
        assert not re.search(r"^ *script:\n *[^ \"]", rule, re.MULTILINE)


def steps_of_rules():
    """Each rule that runs a step, with its module and the names that it gives; one derived from another has its too."""
    rules = {}
    for path in RULES:
        for text in re.split(r"^(?=(?:use )?rule \w)", path.read_text(), flags=re.MULTILINE)[1:]:
            rules[re.match(r"(?:use )?rule (\w+)(?: as (\w+))?", text).group(2) or text.split()[1].rstrip(":")] = text
    for name, text in rules.items():
        base = re.match(r"use rule (\w+)", text)
        step = re.search(r'step="([\w.:]+)"', text) or (base and re.search(r'step="([\w.:]+)"', rules[base[1]]))
        if step:
            inherited = rules[base[1]] if base else ""
            for part in ("input", "output"):  # what a derived rule gives of these stands in the place of all
                if f"    {part}:\n" in text:
                    inherited = re.sub(rf"^    {part}:\n(?:        .*\n)+", "", inherited, flags=re.MULTILINE)
            whole = text + inherited
            unpacked = "unpack(" in text or "**" in text
            yield pytest.param(step[1], whole, unpacked, id=name)


@pytest.mark.parametrize(("step", "rule", "unpacked"), [*steps_of_rules()])
def test_a_step_takes_what_its_rule_gives(step, rule, unpacked):
    given = {*re.findall(r"^        (\w+)=", rule, re.MULTILINE), *re.findall(r"\{(\w+)\}", rule)}
    module, _, function = step.partition(":")
    source = (ROOT / f"{module.replace('.', '/')}.py").read_text()
    if function:
        source = next(part for part in re.split(r"^(?=def )", source, flags=re.MULTILINE) if f"def {function}(" in part)
    taken = set(re.findall(r"\bjob\.(\w+)\b(?!\()", source.replace("job.axes", "(job.source, job.seed)")))
    taken |= {name for names in re.findall(r"job\.per_seed\(([^)*]*)\)", source) for name in re.findall(r"\w+", names)}
    always = {"settings", "threads", "data_dir", "downloads", "section", "per_seed", "get"}
    missing = taken - given - always
    assert not missing or (unpacked and missing <= UNPACKED[step]), missing


UNPACKED = {
    "gpca.steps.causes:model": {"registrations", "embeddings"},
    "gpca.steps.runtime": {"registrations", "embeddings"},
    "gpca.steps.pairs:attribute": {"input_timings"},
}


def test_the_slurm_profile_plans_with_what_the_rules_declare(project):
    pytest.importorskip("snakemake_executor_plugin_slurm")
    done = project.plan("table2", "--profile", "workflow/profiles/slurm")
    assert "profiles/slurm and workflow specific profile profiles/default" in done.stderr
    encoder = re.search(r"^ *rule train_encoder:\n(?: +.*\n)+", done.stdout, re.MULTILINE)[0]  # within its group
    assert "mem_mb=3000" in encoder
    assert "runtime=60" in encoder


def test_common_rules_are_short_and_no_rule_repeats_a_wildcard_of_the_run():
    assert len((ROOT / "workflow/rules/common.smk").read_text().splitlines()) <= 120
    assert not [path.name for path in RULES if "{run}" in path.read_text()]


def test_a_snakefile_elsewhere_plans_into_the_working_directory(project, tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    done = project.plan("--snakefile", project.folder / "Snakefile", "--directory", here, "table2")
    assert "results/default/tables/table2_per_concept.md" in done.stdout


def test_another_workflow_takes_the_suite_as_a_module_with_a_config_over_the_defaults(project, tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    (here / "Snakefile").write_text(
        f"module bench:\n    snakefile: '{project.folder}/Snakefile'\n    config: {{'run': 'mine', 'seeds': [7]}}\n\n"
        "use rule * from bench as bench_*\n"
    )
    done = project.plan("--snakefile", here / "Snakefile", "--directory", here, "bench_table2")
    assert "results/mine/predictions/ycb/gpca/seed7.csv" in done.stdout
    assert "rule bench_table2_per_concept" in done.stdout and "seed0" not in done.stdout
