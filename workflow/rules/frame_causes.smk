# Instances of depth frames -> registrations with measured causes, and their re-enactments.
FRAME_CAUSES = {
    "datasets": REAL_WORLD["datasets"],
    "role": config["splits"]["role"],
    "causes": config["causes"],
    **ICP,
}


rule measure_frame_causes:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes") if REAL_WORLD["datasets"] else [],
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
        code=code_stamp("gpca.steps.frames:frame_causes"),
    output:
        frame_causes="<results>/frame_causes/seed{seed}.npz",
        samples="<results>/frame_causes/seed{seed}.csv",
        starts="<results>/frame_starts/seed{seed}.npz",
    log:
        "<logs>/frame_causes/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_causes/seed{seed}.tsv"
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.frames:frame_causes",
        settings=as_json({"frames": REAL_WORLD["causes"], **FRAME_CAUSES}),
        source=FRAMES,
        folders=DATA_FOLDERS,
    script:
        "../scripts/step.py"


rule reenact_frames:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes") if REAL_WORLD["datasets"] else [],
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
        frame_causes="<results>/frame_causes/seed{seed}.npz",
        starts="<results>/frame_starts/seed{seed}.npz",
        code=code_stamp("gpca.steps.frames:reenact_frames"),
    output:
        reenactments=f"<results>/reenactments/{FRAMES}/seed{{seed}}.npz",
    log:
        f"<logs>/reenactments/{FRAMES}/seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/reenactments/{FRAMES}/seed{{seed}}.tsv"
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.frames:reenact_frames",
        settings=as_json(
            {
                "reenactment": DIAGNOSIS["reenactment"] | REAL_WORLD["reenactment"],
                **FRAME_CAUSES,
            }
        ),
        source=FRAMES,
        folders=DATA_FOLDERS,
    script:
        "../scripts/step.py"
