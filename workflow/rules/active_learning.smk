# Embeddings -> learning curves of every acquisition strategy, for a concept that the classifier has never seen.
from gpca.active_learning.acquisition import strategy_module

# Which strategies there are is no setting of theirs: another one leaves the files of these as they are.
LEARNING_SETTINGS = {
    name: value
    for name, value in config["active_learning"].items()
    if name != "strategies"
}


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


OUTSIDE_STRATEGIES = [name for name in NAMES["strategy"] if strategy_module(name)]
STRATEGIES = [name for name in NAMES["strategy"] if name not in OUTSIDE_STRATEGIES]


rule learn_actively:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        embeddings=f"<results>/embeddings/{{source}}/{EMBEDDING}/seed{{seed}}.npz",
        embeddings_without="<results>/embeddings/{source}/without/seed{seed}.npz",
        code=code_files("gpca.experiments.active_learning.step"),
    output:
        out=collect(
            "<results>/active_learning/{{source}}/{strategy}/seed{{seed}}.csv",
            strategy=STRATEGIES,
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
        settings=lambda wildcards: as_json(learning_settings(wildcards.seed)),
        strategies=STRATEGIES,
    script:
        "../scripts/step.py"


# Strategies from outside, a job each, so that an edit of one leaves all others as they are.
use rule learn_actively as learn_actively_outside with:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        embeddings=f"<results>/embeddings/{{source}}/{EMBEDDING}/seed{{seed}}.npz",
        embeddings_without="<results>/embeddings/{source}/without/seed{seed}.npz",
        code=lambda wildcards: code_files(
            "gpca.experiments.active_learning.step",
            strategy_module(wildcards.outside_strategy),
        ),
    output:
        out=["<results>/active_learning/{source}/{outside_strategy}/seed{seed}.csv"],
    log:
        "<logs>/active_learning/{source}/{outside_strategy}/seed{seed}.log",
    benchmark:
        "<benchmarks>/active_learning/{source}/{outside_strategy}/seed{seed}.tsv"
    wildcard_constraints:
        outside_strategy="|".join(OUTSIDE_STRATEGIES) or "none",
    params:
        strategies=lambda wildcards: [wildcards.outside_strategy],
