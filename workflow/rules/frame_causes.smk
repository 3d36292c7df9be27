# Instances of depth frames -> registrations with measured causes -> what explainers of simulated causes say of them.
from gpca.frames.source import estimated

ESTIMATED = estimated(config)


rule measure_frame_causes:
    input:
        **FRAMES_FROM,
        instances=f"<results>/instances/{ESTIMATED}.npz",
        objects=f"<results>/objects/{ESTIMATED}.npz",
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
            *(explainer_module(name, CAUSES) for name in DIAGNOSIS["explainers"]),
        ),
    output:
        causes="<results>/frame_causes/seed{seed}.npz",
        samples="<results>/frame_causes/seed{seed}.csv",
        predictions="<results>/frame_diagnoses/seed{seed}.csv",
    log:
        "<logs>/frame_causes/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_causes/seed{seed}.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=as_json(
            {
                "frames": REAL_WORLD["causes"],
                "datasets": REAL_WORLD["datasets"],
                "causes": config["causes"],
                **ICP,
                **DIAGNOSIS,
            }
        ),
        source=FRAMES,
        frames=lambda wildcards, input: (
            ["--scenes", input.scenes]
            if input.get("scenes")
            else folder_options(config["data_dir"], config["downloads"])
        ),
    shell:
        "python -m gpca frame_causes --threads {threads} --source {params.source} --seed {wildcards.seed} "
        "--settings {params.settings:q} {params.frames:q} --instances {input.instances} --objects {input.objects} "
        "--causes {input.causes} --descriptors {input.descriptors} --encoders {input.encoders} "
        "--embeddings {input.embeddings} --out {output.causes} --samples {output.samples} "
        "--predictions {output.predictions} 2> {log}"


rule frame_causes:
    input:
        causes_files=collect(
            "<results>/frame_causes/seed{seed}.npz", seed=NAMES["frame_cause_seed"]
        ),
        sample_files=collect(
            "<results>/frame_causes/seed{seed}.csv", seed=NAMES["frame_cause_seed"]
        ),
        prediction_files=collect(
            "<results>/frame_diagnoses/seed{seed}.csv", seed=NAMES["frame_cause_seed"]
        ),
        code=collector_code("gpca.experiments.frame_causes.metrics:collect"),
    output:
        "<results>/frame_causes.csv",
    log:
        "<logs>/frame_causes.log",
    benchmark:
        "<benchmarks>/frame_causes.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.experiments.frame_causes.metrics:collect",
    script:
        "../scripts/collect.py"
