# Embeddings -> learning curves of every acquisition strategy, for a concept that the classifier has never seen.
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
    params:
        step="gpca.experiments.active_learning.step",
        settings=settings("active_learning"),
        strategies=NAMES["strategy"],
    script:
        "../scripts/step.py"
