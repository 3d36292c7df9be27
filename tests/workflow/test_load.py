import re

import pytest

from .conftest import ROOT

RULES = sorted((ROOT / "workflow/rules").glob("*.smk"))


@pytest.mark.parametrize(
    ("config", "run", "sources", "seeds", "backbones", "reductions"),
    [("config", "embedded", 3, 3, 4, 4), ("smoke", "smoke", 2, 2, 1, 2), ("real", "real", 3, 5, 4, 4)],
)
def test_every_config_loads_offline_and_asks_for_all_results(
    project, config, run, sources, seeds, backbones, reductions
):
    planned = project.dry_run("all", "--configfile", f"config/{config}.yaml")
    assert "profiles/default" in planned.messages
    assert planned.jobs["objects"] == sources
    assert planned.jobs["registrations"] == sources * seeds
    assert planned.jobs["encoder"] == (sources + backbones) * seeds
    assert planned.jobs["explain"] == sources * 19 + 2
    assert planned.jobs["explain_with_backbone"] == backbones * reductions
    assert planned.jobs["scenes"] == (config != "real")
    assert planned.jobs["uncertainty"] == sources * 6
    assert planned.jobs["shift"] == planned.jobs["learn"] == sources
    assert planned.jobs["kernels"] == (1 if config == "smoke" else 2)
    assert planned.jobs["embeddings_without"] == planned.jobs["active_learning"] == sources * seeds
    for name in (
        "metrics.csv",
        "timings.csv",
        "tables/table1_single_baselines.md",
        "tables/table2_per_concept.tex",
        "tables/table3_stream.csv",
        "tables/table6_backbones.tex",
        "poses/real_rgbd/seed0.csv",
        "tables/table4_kernels.md",
        "tables/table5_claims.tex",
        "diagnostics.csv",
        "kernels.csv",
        "comparison.csv",
        "figures/reliability.pdf",
    ):
        assert f"results/{run}/{name}" in planned.outputs
    assert {f"results/{run}/figures/{name}.png" for name in ("fig3_concepts", "objects_ycb")} <= planned.outputs
    assert all(path.startswith(f"results/{run}/") for path in planned.outputs)
    assert not (project.folder / "results").exists()


def test_the_smoke_target_runs_the_smoke_config(project):
    assert project.dry_run("smoke").outputs == {"results/smoke/complete"}


def test_the_snakefile_fits_on_a_page():
    assert len((ROOT / "Snakefile").read_text().splitlines()) <= 60


@pytest.mark.parametrize("path", RULES, ids=lambda path: path.name)
def test_every_rule_says_what_it_needs_and_where_it_logs(path):
    for rule in re.split(r"^rule ", path.read_text(), flags=re.MULTILINE)[1:]:
        for keyword in ("log", "benchmark", "threads", "resources", "conda"):
            assert f"\n    {keyword}:" in rule, (rule.split(":")[0], keyword)
        assert "\n    run:" not in rule


def test_the_slurm_profile_plans_everything_with_what_the_rules_declare(project):
    pytest.importorskip("snakemake_executor_plugin_slurm")
    done = project.snakemake("-n", "all", "--profile", "workflow/profiles/slurm")
    assert "profiles/slurm and workflow specific profile profiles/default" in done.stderr
    encoder = re.search(r"^rule encoder:\n(?:    .*\n)+", done.stdout, re.MULTILINE)[0]
    assert "mem_mb=3000" in encoder
    assert "runtime=60" in encoder
