# Embeddings of depth frames -> learning curves of a new concept, by backbones and by the pair.
rule learn_on_frames:
    input:
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        embeddings=collect(
            f"<results>/embeddings/{FRAMES}/{{encoder}}/none/seed{{{{seed}}}}.npz",
            encoder=NAMES["frame_label_backbone"],
        ),
        code=code_files("gpca.experiments.frame_labels.step"),
    output:
        out=collect(
            f"<results>/frame_labels/{FRAMES}/{{strategy}}/seed{{{{seed}}}}.csv",
            strategy=NAMES["new_concept_strategy"],
        ),
    log:
        "<logs>/frame_labels/seed{seed}.log",
    benchmark:
        "<benchmarks>/frame_labels/seed{seed}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.frame_labels.step",
        settings=as_json(
            {
                "frame_labels": config["frame_labels"],
                "active_learning": LEARNING_SETTINGS,
            }
        ),
        source=FRAMES,
        backbones=NAMES["frame_label_backbone"],
        strategies=NAMES["new_concept_strategy"],
    script:
        "../scripts/step.py"
