# Depth frames, of datasets or rendered in their place -> partial clouds -> registrations.
from gpca.frames.source import frame_files
from gpca.objects.source import folder_options

REAL_WORLD = config["real_world"]
if REAL_WORLD["datasets"]:
    FRAMES_FROM = {"data": frame_files(REAL_WORLD["datasets"], config["data_dir"])}
else:
    FRAMES_FROM = {"scenes": f"<results>/scenes/{FRAMES}"}


rule render_scenes:
    input:
        code=code_files(
            "gpca.steps.scenes",
            *shapes_code(REAL_WORLD["scenes"]["families"]),
        ),
    output:
        directory(f"<results>/scenes/{FRAMES}"),
    log:
        "<logs>/scenes.log",
    benchmark:
        "<benchmarks>/scenes.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=settings("real_world", "scenes"),
        source=FRAMES,
    shell:
        "python -m gpca scenes --threads {threads} --source {params.source} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule instances:
    input:
        **FRAMES_FROM,
        code=code_files("gpca.steps.instances"),
    output:
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
    log:
        "<logs>/instances.log",
    benchmark:
        "<benchmarks>/instances.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=as_json(
            {name: REAL_WORLD[name] for name in ("datasets", "initial_pose", "gap")}
        ),
        source=FRAMES,
        frames=lambda wildcards, input: (
            ["--scenes", input.scenes]
            if input.get("scenes")
            else folder_options(config["data_dir"], config["downloads"])
        ),
        surface_points=config["objects"]["surface_points"],
    shell:
        "python -m gpca instances --threads {threads} --source {params.source} --settings {params.settings:q} "
        "{params.frames:q} --surface-points {params.surface_points} --out {output.instances} --objects {output.objects} 2> {log}"


rule register_frames:
    input:
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
        code=code_files("gpca.steps.frame_registrations"),
    output:
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        poses=f"<results>/poses/{FRAMES}/seed{{seed}}.csv",
        timings=f"<results>/timings/{FRAMES}/icp/seed{{seed}}.csv",
    log:
        f"<logs>/registrations/{FRAMES}/seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/registrations/{FRAMES}/seed{{seed}}.tsv"
    priority: 11
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=as_json(
            config["registrations"]
            | {
                name: REAL_WORLD[name]
                for name in ("train", "test", "test_share", "occluders")
            }
        ),
        source=FRAMES,
    shell:
        "python -m gpca frame_registrations --threads {threads} --instances {input.instances} "
        "--objects {input.objects} --source {params.source} --seed {wildcards.seed} --settings {params.settings:q} "
        "--out {output.registrations} --poses {output.poses} --timings {output.timings} 2> {log}"


rule real_world:
    input:
        prediction_files=collect(
            f"<results>/predictions/{FRAMES}/{{method}}/seed{{seed}}.csv",
            method=[*NAMES["backbone"], *NAMES["classic"]],
            seed=SEEDS,
        ),
        code=collector_code("gpca.attribution.metrics:collect"),
    output:
        "<results>/real_world.csv",
    log:
        "<logs>/real_world.log",
    benchmark:
        "<benchmarks>/real_world.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.attribution.metrics:collect",
    script:
        "../scripts/collect.py"
