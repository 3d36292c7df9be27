# Sources -> canonical clouds.
from gpca.objects.source import data_files, data_folders, source_modules


rule objects:
    input:
        collect("<results>/objects/{source}.npz", source=SOURCES),


rule sample_objects:
    input:
        data=lambda wildcards: data_files(SOURCES[wildcards.source]),
        splits=split_file("objects"),
        code=lambda wildcards: code_files(
            "gpca.steps.pairs:objects", *source_modules(SOURCES[wildcards.source])
        ),
    output:
        out="<results>/objects/{source}.npz",
    log:
        "<logs>/objects/{source}.log",
    benchmark:
        "<benchmarks>/objects/{source}.tsv"
    wildcard_constraints:
        source="|".join(CONFIGURED_SOURCES),
    priority: 20  # everything waits for it
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:objects",
        settings=settings("sources", "{source}"),
        folders=lambda wildcards: data_folders(
            SOURCES[wildcards.source], config["data_dir"], config["downloads"]
        ),
        surface_points=config["objects"]["surface_points"],
    script:
        "../scripts/step.py"
