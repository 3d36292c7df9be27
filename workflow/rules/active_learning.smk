# Embeddings -> learning curves of every acquisition strategy; and of concepts that are new to the encoder, too.
rule embed_without:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        code=code_files(
            "gpca.experiments.active_learning.without_step",
            encoder_module(config["embedding"]["encoder"]),
        ),
    output:
        out="<results>/embeddings/{source}/without/seed{seed}.npz",
    log:
        "<logs>/embeddings/{source}/without/seed{seed}.log",
    benchmark:
        "<benchmarks>/embeddings/{source}/without/seed{seed}.tsv"
    priority: 7
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        step="gpca.experiments.active_learning.without_step",
        settings=as_json(
            config["encoders"][config["embedding"]["encoder"]]
            | config["active_learning"]["without"]
        ),
        concepts=config["active_learning"]["held_out"],
    script:
        "../scripts/step.py"


rule learn_actively:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        embeddings=f"<results>/embeddings/{{source}}/{EMBEDDING}/seed{{seed}}.npz",
        embeddings_without="<results>/embeddings/{source}/without/seed{seed}.npz",
        code=code_files("gpca.experiments.active_learning.step"),
    output:
        out=collect(
            "<results>/active_learning/{{source}}/{strategy}/seed{{seed}}.csv",
            strategy=NAMES["strategy"],
        ),
    log:
        "<logs>/active_learning/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/active_learning/{source}/seed{seed}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        step="gpca.experiments.active_learning.step",
        settings=settings("active_learning"),
        strategies=NAMES["strategy"],
    script:
        "../scripts/step.py"


rule active_learning:
    input:
        files=collect(
            "<results>/active_learning/{source}/{strategy}/seed{seed}.csv",
            source=SOURCES,
            strategy=NAMES["strategy"],
            seed=SEEDS,
        ),
        code=collector_code("gpca.active_learning.metrics:collect_curves"),
    output:
        "<results>/active_learning.csv",
    log:
        "<logs>/active_learning.log",
    benchmark:
        "<benchmarks>/active_learning.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.active_learning.metrics:collect_curves",
        target=config["active_learning"]["target"],
    script:
        "../scripts/collect.py"


NEW = config["new_concepts"]
NEW_SEEDS = NAMES["new_concept_seed"]
NEW_ENCODER = config["embedding"]["encoder"]
NEW_SETTINGS = {
    "new_concepts": NEW,
    "active_learning": config["active_learning"],
    "encoder": config["encoders"][NEW_ENCODER],
    "cause_encoder": DIAGNOSIS["encoder"],
    "causes": config["causes"],
    "descriptors": DIAGNOSIS["descriptors"],
}


rule learn_new_concepts:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        encoders=lambda wildcards: [*encoders_of_others(wildcards).values()],
        objects="<results>/objects/{source}.npz",
        causes="<results>/causes/{source}/seed{seed}.npz",
        descriptors="<results>/descriptors/{source}/seed{seed}.npz",
        cause_encoder="<results>/cause_encoders/{source}/seed{seed}.pt",
        cause_embeddings="<results>/cause_embeddings/{source}/seed{seed}.npz",
        code=code_files(
            "gpca.experiments.new_concepts.step",
            encoder_module(NEW_ENCODER),
            backbone_module(DIAGNOSIS["encoder"]),
        ),
    output:
        out=collect(
            "<results>/new_concepts/{{source}}/{strategy}/seed{{seed}}.csv",
            strategy=NAMES["new_concept_strategy"],
        ),
    log:
        "<logs>/new_concepts/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/new_concepts/{source}/seed{seed}.tsv"
    priority: 6
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        step="gpca.experiments.new_concepts.step",
        settings=as_json(NEW_SETTINGS | ICP),
        encoders_of=lambda wildcards: [*encoders_of_others(wildcards)],
        strategies=NAMES["new_concept_strategy"],
    script:
        "../scripts/step.py"


rule new_concepts:
    input:
        files=collect(
            "<results>/new_concepts/{source}/{strategy}/seed{seed}.csv",
            source=SOURCES,
            strategy=NAMES["new_concept_strategy"],
            seed=NEW_SEEDS,
        ),
        code=collector_code("gpca.active_learning.metrics:collect_curves"),
    output:
        "<results>/new_concepts.csv",
    log:
        "<logs>/new_concepts.log",
    benchmark:
        "<benchmarks>/new_concepts.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.active_learning.metrics:collect_curves",
        target=config["active_learning"]["target"],
    script:
        "../scripts/collect.py"


rule learn_on_frames:
    input:
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        embeddings=collect(
            f"<results>/embeddings/{FRAMES}/{{encoder}}/none/seed{{{{seed}}}}.npz",
            encoder=config["real_world"]["backbones"],
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
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        step="gpca.experiments.frame_labels.step",
        settings=as_json(
            {
                "frame_labels": config["frame_labels"],
                "active_learning": config["active_learning"],
            }
        ),
        source=FRAMES,
        backbones=config["real_world"]["backbones"],
        strategies=NAMES["new_concept_strategy"],
    script:
        "../scripts/step.py"
