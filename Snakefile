# GP-CA Bench. `snakemake -j2 all` makes every table and figure of the run that the config names.
import sys

sys.path.insert(0, workflow.basedir)
from gpca.config import check as run_config
from gpca.errors import InputError


configfile: "config/sources.yaml"
configfile: "config/config.yaml"


try:
    GIVEN_CONFIG, config, SOURCES = run_config.read(config, workflow.config_settings.config)
except InputError as fault:
    sys.exit(f"gpca: {fault}")
run_config.export(config)


wildcard_constraints:
    run=config["run"],
    seed=r"\d+",


include: "workflow/rules/common.smk"
include: "workflow/rules/objects.smk"
include: "workflow/rules/registrations.smk"
include: "workflow/rules/encoders.smk"
include: "workflow/rules/uncertainty.smk"
include: "workflow/rules/explainers.smk"
include: "workflow/rules/active_learning.smk"
include: "workflow/rules/ablations.smk"
include: "workflow/rules/real_world.smk"
include: "workflow/rules/model.smk"
include: "workflow/rules/recovery.smk"
include: "workflow/rules/collect.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/comparison.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        collect("results/{run}/{file}", run=config["run"], file=RESULTS),


rule smoke:
    output:
        touch("results/smoke/complete"),
    log:
        "results/logs/smoke.log",
    conda:
        "workflow/envs/gpca.yaml"
    threads: 2
    resources:
        mem_mb=4000,
    shell:
        "python -m snakemake -j{threads} all --configfile config/smoke.yaml --nolock 2>&1 | tee {log} >&2"
