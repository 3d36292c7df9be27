# What else can be asked for by name: what the paper shows, its numbers (table2, fig5), the smoke run.
import os

from gpca.reporting.registry import targets, unknown_target

SHORT = targets(RESULTS)


rule paper:
    input:
        [f"<results>/{result.all_files[0]}" for result in RESULTS if result.paper],


for short, result in SHORT.items():

    rule:
        name:
            short
        input:
            f"<results>/{result.all_files[0]}",


# Of another config, so another Snakemake runs it.
rule smoke:
    output:
        touch("results/smoke/complete"),
    log:
        "results/logs/smoke.log",
    conda:
        "../envs/gpca.yaml"
    threads: 2
    resources:
        mem_mb=4000,
    params:
        snakefile=os.path.relpath(f"{workflow.current_basedir}/../../Snakefile"),
        config=os.path.relpath(f"{workflow.current_basedir}/../../config/smoke.yaml"),
    shell:
        "python -m snakemake --snakefile {params.snakefile:q} -j{threads} all --configfile {params.config:q} "
        "--nolock 2>&1 | tee {log} >&2"


# A target that is no rule's name is taken for a file; without a folder it is a name that was misspelt.
rule misspelt:
    input:
        lambda wildcards: sys.exit(
            unknown_target(
                wildcards.name,
                [rule.name for rule in workflow.rules if not rule.has_wildcards()],
            )
        ),
    output:
        "{name}",
    log:
        "<logs>/{name}.log",
    wildcard_constraints:
        name=r"\w+",
    conda:
        "../envs/gpca.yaml"
    shell:
        "exit 2"
