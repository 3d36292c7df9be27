# Depth frames, of datasets or rendered in their place -> partial clouds -> registrations.
from gpca.frames.source import conditions_of, frame_files

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
FRAME_PREDICTIONS = [
    f"<results>/predictions/{name}.csv" for name in NAMES["frame_prediction"]
]


wildcard_constraints:
    frames="|".join(CONDITIONS),


rule render_scenes:
    input:
        code=code_stamp("gpca.steps.frames:scenes"),
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
        code=code_stamp("gpca.steps.frames:instances"),
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
        code=code_stamp("gpca.steps.frames:frame_registrations"),
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
