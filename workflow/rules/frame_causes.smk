# Instances of depth frames -> registrations with measured causes -> what explainers of simulated causes say of them.
FRAME_CAUSES = {
    "datasets": REAL_WORLD["datasets"],
    "role": config["splits"]["role"],
    "causes": config["causes"],
    **ICP,
}
# Those from outside have jobs of their own, so that an edit of one leaves the others, and what follows, as they are.
FRAME_EXPLAINERS = [
    name for name in DIAGNOSIS["explainers"] if name not in NAMES["outside_explainer"]
]


rule measure_frame_causes:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes") if REAL_WORLD["datasets"] else [],
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
        code=code_files("gpca.steps.frames:frame_causes"),
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
        code=code_files("gpca.steps.frames:reenact_frames"),
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


rule diagnose_frames:
    input:
        frame_causes="<results>/frame_causes/seed{seed}.npz",
        frame_reenactments=if_enacted(
            f"<results>/reenactments/{FRAMES}/seed{{seed}}.npz"
        ),
        causes=collect("<results>/causes/{source}/seed{{seed}}.npz", source=SOURCES),
        descriptors=collect(
            "<results>/descriptors/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        reenactments=if_enacted(
            collect("<results>/reenactments/{source}/seed{{seed}}.npz", source=SOURCES)
        ),
        encoders=collect(
            "<results>/cause_encoders/{source}/seed{{seed}}.pt", source=SOURCES
        ),
        embeddings=collect(
            "<results>/cause_embeddings/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        code=code_files(
            "gpca.steps.diagnosis:diagnose_frames",
            backbone_module(DIAGNOSIS["encoder"]),
            *(explainer_module(name, CAUSES) for name in FRAME_EXPLAINERS),
        ),
    output:
        predictions="<results>/frame_diagnoses/seed{seed}.csv",
    log:
        "<logs>/frame_diagnoses/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_diagnoses/seed{seed}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.diagnosis:diagnose_frames",
        settings=frame_diagnosis(FRAME_EXPLAINERS),
        source=FRAMES,
    script:
        "../scripts/step.py"


use rule diagnose_frames as diagnose_frames_outside with:
    input:
        frame_causes="<results>/frame_causes/seed{seed}.npz",
        frame_reenactments=if_enacted(
            f"<results>/reenactments/{FRAMES}/seed{{seed}}.npz"
        ),
        causes=collect("<results>/causes/{source}/seed{{seed}}.npz", source=SOURCES),
        descriptors=collect(
            "<results>/descriptors/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        reenactments=if_enacted(
            collect("<results>/reenactments/{source}/seed{{seed}}.npz", source=SOURCES)
        ),
        encoders=collect(
            "<results>/cause_encoders/{source}/seed{{seed}}.pt", source=SOURCES
        ),
        embeddings=collect(
            "<results>/cause_embeddings/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        code=lambda wildcards: code_files(
            "gpca.steps.diagnosis:diagnose_frames",
            backbone_module(DIAGNOSIS["encoder"]),
            explainer_module(wildcards.outside_explainer, CAUSES),
        ),
    output:
        predictions="<results>/frame_diagnoses/{outside_explainer}/seed{seed}.csv",
    log:
        "<logs>/frame_diagnoses/{outside_explainer}/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_diagnoses/{outside_explainer}/seed{seed}.tsv"
    wildcard_constraints:
        outside_explainer="|".join(NAMES["outside_explainer"]) or "none",
    params:
        settings=lambda wildcards: frame_diagnosis([wildcards.outside_explainer]),
