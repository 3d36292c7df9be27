# Registrations, causes and encoders -> learning curves of concepts that no encoder has seen.
NEW = config["new_concepts"]
NEW_ENCODER = config["embedding"]["encoder"]
NEW_SETTINGS = {
    "new_concepts": NEW,
    "active_learning": LEARNING_SETTINGS,
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
    params:
        step="gpca.experiments.new_concepts.step",
        settings=as_json(NEW_SETTINGS | ICP),
        encoders_of=lambda wildcards: [*encoders_of_others(wildcards)],
        strategies=NAMES["new_concept_strategy"],
    script:
        "../scripts/step.py"
