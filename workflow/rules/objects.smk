# Sources -> canonical clouds.
from gpca.objects.source import data_files, data_options, source_modules


rule objects:
    input:
        collect("<results>/objects/{source}.npz", source=SOURCES),


rule sample_objects:
    input:
        data=lambda wildcards: data_files(SOURCES[wildcards.source]),
        code=lambda wildcards: code_files(
            "gpca.steps.objects", *source_modules(SOURCES[wildcards.source])
        ),
    output:
        "<results>/objects/{source}.npz",
    log:
        "<logs>/objects/{source}.log",
    benchmark:
        "<benchmarks>/objects/{source}.tsv"
    wildcard_constraints:
        source="|".join(CONFIGURED_SOURCES),
    priority: 20  # everything waits for it
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=settings("sources", "{source}"),
        data=lambda wildcards: data_options(
            SOURCES[wildcards.source], config["data_dir"], config["downloads"]
        ),
        surface_points=config["objects"]["surface_points"],
    shell:
        "python -m gpca objects --threads {threads} --source {wildcards.source} --settings {params.settings:q} "
        "{params.data:q} --surface-points {params.surface_points} --out {output} 2> {log}"
