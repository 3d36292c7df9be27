# Sources -> canonical clouds.
from gpca.objects.source import data_files, data_folders, resolve, source_modules

# Sources of the run, and the development objects of a joint reading.
SAMPLED_OBJECTS = {name: SOURCES[name] for name in CONFIGURED_SOURCES}
if NAMES["development_source"]:
    SAMPLED_OBJECTS[NAMES["development_source"]] = resolve(
        config["joint_reading"]["objects"], config["data_dir"]
    )


rule objects:
    input:
        collect("<results>/objects/{source}.npz", source=SOURCES),


rule sample_objects:
    input:
        data=lambda wildcards: data_files(SAMPLED_OBJECTS[wildcards.source]),
        splits=split_file("objects"),
        code=lambda wildcards: code_stamp(
            "gpca.steps.pairs:objects",
            *source_modules(SAMPLED_OBJECTS[wildcards.source]),
        ),
    output:
        out="<results>/objects/{source}.npz",
    log:
        "<logs>/objects/{source}.log",
    benchmark:
        "<benchmarks>/objects/{source}.tsv"
    wildcard_constraints:
        source="|".join(SAMPLED_OBJECTS),
    priority: 20  # everything waits for it
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:objects",
        settings=lambda wildcards: as_json(
            config["sources"].get(wildcards.source)
            or config["joint_reading"]["objects"]
        ),
        folders=lambda wildcards: data_folders(
            SAMPLED_OBJECTS[wildcards.source], config["data_dir"], config["downloads"]
        ),
        surface_points=config["objects"]["surface_points"],
    script:
        "../scripts/step.py"
