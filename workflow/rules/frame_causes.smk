# Instances of depth frames -> registrations with measured causes -> what explainers of simulated causes say of them.
rule measure_frame_causes:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes") if REAL_WORLD["datasets"] else [],
        instances=f"<results>/instances/{FRAMES}.npz",
        objects=f"<results>/objects/{FRAMES}.npz",
        causes=collect("<results>/causes/{source}/seed{{seed}}.npz", source=SOURCES),
        descriptors=collect(
            "<results>/descriptors/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        encoders=collect(
            "<results>/cause_encoders/{source}/seed{{seed}}.pt", source=SOURCES
        ),
        embeddings=collect(
            "<results>/cause_embeddings/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        code=code_files(
            "gpca.experiments.frame_causes.step",
            backbone_module(DIAGNOSIS["encoder"]),
            *(explainer_module(name, CAUSES) for name in explained_on_frames()),
        ),
    output:
        frame_causes="<results>/frame_causes/seed{seed}.npz",
        samples="<results>/frame_causes/seed{seed}.csv",
        predictions="<results>/frame_diagnoses/seed{seed}.csv",
    log:
        "<logs>/frame_causes/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_causes/seed{seed}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.frame_causes.step",
        settings=as_json(
            {
                "frames": REAL_WORLD["causes"],
                "datasets": REAL_WORLD["datasets"],
                "role": config["splits"]["role"],
                "causes": config["causes"],
                **ICP,
                **DIAGNOSIS,
                "explainers": explained_on_frames(),
            }
        ),
        source=FRAMES,
        folders=DATA_FOLDERS,
    script:
        "../scripts/step.py"
