# Depth frames, of datasets or rendered in their place -> partial clouds -> registrations.
from gpca.frames.source import ONE_ENCODER, conditions_of, frame_files

REAL_WORLD = config["real_world"]
CONDITIONS = {FRAMES: REAL_WORLD["initial_pose"]} | {
    f"{FRAMES}_{name}": entry for name, entry in conditions_of(config).items()
}
if REAL_WORLD["datasets"]:
    FRAMES_FROM = {"data": frame_files(REAL_WORLD["datasets"], config["data_dir"])}
else:
    FRAMES_FROM = {"scenes": f"<results>/scenes/{FRAMES}"}
# Where a step looks for data and keeps downloads; nowhere, where frames are rendered.
DATA_FOLDERS = (
    {name: config[name] for name in ("data_dir", "downloads")}
    if REAL_WORLD["datasets"]
    else {}
)
# What is asked about frames: source -> methods.
ASKED = {
    FRAMES: [
        *NAMES["backbone"],
        *NAMES["published"],
        *NAMES["classic"],
        *NAMES["frame_explainer"],
    ],
    **{
        condition: [*NAMES["condition_backbone"], *NAMES["frame_explainer"]]
        for condition in NAMES["condition"]
    },
}
FRAME_PREDICTIONS = [
    f"<results>/predictions/{source}/{method}/seed{seed}.csv"
    for source, methods in ASKED.items()
    for method in methods
    for seed in seeds_of_frame_row(method)
]


wildcard_constraints:
    frames="|".join(CONDITIONS),


rule render_scenes:
    input:
        code=code_files("gpca.steps.frames:scenes"),
    output:
        out=directory(f"<results>/scenes/{FRAMES}"),
    log:
        "<logs>/scenes.log",
    benchmark:
        "<benchmarks>/scenes.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.frames:scenes",
        settings=settings("real_world", "scenes"),
        source=FRAMES,
    script:
        "../scripts/step.py"


rule instances:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes") if REAL_WORLD["datasets"] else [],
        code=code_files("gpca.steps.frames:instances"),
    output:
        instances="<results>/instances/{frames}.npz",
        objects="<results>/objects/{frames}.npz",
    log:
        "<logs>/instances/{frames}.log",
    benchmark:
        "<benchmarks>/instances/{frames}.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.frames:instances",
        settings=lambda wildcards: as_json(
            {
                "datasets": REAL_WORLD["datasets"],
                "initial_pose": CONDITIONS[wildcards.frames],
                "role": config["splits"]["role"],
            }
        ),
        source=FRAMES,
        name="{frames}",
        folders=DATA_FOLDERS,
        surface_points=config["objects"]["surface_points"],
    script:
        "../scripts/step.py"


rule register_frames:
    input:
        instances="<results>/instances/{frames}.npz",
        objects="<results>/objects/{frames}.npz",
        code=code_files("gpca.steps.frames:frame_registrations"),
    output:
        registrations="<results>/registrations/{frames}/seed{seed}.npz",
        poses="<results>/poses/{frames}/seed{seed}.csv",
        timings="<results>/timings/{frames}/icp/seed{seed}.csv",
    log:
        "<logs>/registrations/{frames}/seed{seed}.log",
    benchmark:
        "<benchmarks>/registrations/{frames}/seed{seed}.tsv"
    priority: 11
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.frames:frame_registrations",
        settings=as_json(
            config["registrations"]
            | {
                name: REAL_WORLD[name]
                for name in ("train", "test", "test_share", "occluders")
            }
        ),
        source=FRAMES,  # conditions have its splits and draws
        name="{frames}",
    script:
        "../scripts/step.py"


rule real_world:
    input:
        prediction_files=FRAME_PREDICTIONS,
        one_encoder_files=collect(
            f"<results>/predictions/{ONE_ENCODER}/{{method}}/seed{{seed}}.csv",
            method=NAMES["backbone"] if REAL_WORLD["one_encoder"] else [],
            seed=SEEDS,
        ),
        pose_files=collect(
            "<results>/poses/{source}/seed{seed}.csv", source=CONDITIONS, seed=SEEDS
        ),
        label_files=collect(
            f"<results>/frame_labels/{FRAMES}/{{strategy}}/seed{{seed}}.csv",
            strategy=NAMES["new_concept_strategy"],
            seed=NAMES["frame_label_seed"],
        ),
        code=collector_code("gpca.experiments.real_world.metrics:collect"),
    output:
        "<results>/real_world.csv",
    log:
        "<logs>/real_world.log",
    benchmark:
        "<benchmarks>/real_world.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    params:
        collector="gpca.experiments.real_world.metrics:collect",
        targets=config["frame_labels"]["targets"],
    script:
        "../scripts/collect.py"


rule real_world_intervals:
    input:
        prediction_files=FRAME_PREDICTIONS,
        pose_files=collect(
            "<results>/poses/{source}/seed{seed}.csv", source=CONDITIONS, seed=SEEDS
        ),
        code=collector_code("gpca.experiments.real_world.intervals:collect_intervals"),
    output:
        "<results>/real_world_intervals.csv",
    log:
        "<logs>/real_world_intervals.log",
    benchmark:
        "<benchmarks>/real_world_intervals.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    params:
        collector="gpca.experiments.real_world.intervals:collect_intervals",
        first=NAMES["first_backbone"],
    script:
        "../scripts/collect.py"
