# Registrations and encoders -> samples unlike those of the training -> predictions of every learner (Table V).
ENCODER = config["embedding"]["encoder"]
# A learner that is an explainer of the config too has its settings, and those of its own besides.
LEARNER_SETTINGS = {
    name: (config["explainers"].get(name) or {}) | (own or {})
    for name, own in config["learners"].items()
}


rule shifted:
    input:
        collect("<results>/shifted/{source}/seed{seed}.npz", source=SOURCES, seed=SEEDS),


rule learners:
    input:
        collect(
            "<results>/learners/{source}/{learner}/seed{seed}.csv",
            source=SOURCES,
            learner=LEARNER_SETTINGS,
            seed=SEEDS,
        ),


rule shift:
    input:
        objects="<results>/objects/{source}.npz",
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        embeddings=collect(
            f"<results>/embeddings/{{{{source}}}}/{EMBEDDING}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        encoders=collect(
            f"<results>/encoders/{{{{source}}}}/{ENCODER}/seed{{seed}}.pt", seed=SEEDS
        ),
        # Of a source that the encoder never saw, the first other one.
        other_registrations=lambda wildcards: collect(
            "<results>/registrations/{source}/seed{seed}.npz",
            source=[name for name in SOURCES if name != wildcards.source][:1],
            seed=SEEDS,
        ),
        code=code_files(
            "gpca.experiments.out_of_distribution.shift_step", encoder_module(ENCODER)
        ),
    output:
        out=collect("<results>/shifted/{{source}}/seed{seed}.npz", seed=SEEDS),
    log:
        "<logs>/shifted/{source}.log",
    benchmark:
        "<benchmarks>/shifted/{source}.tsv"
    priority: 6
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.out_of_distribution.shift_step",
        settings=as_json(
            {
                "shift": config["shift"],
                "registrations": config["registrations"],
                "encoder": config["encoders"][ENCODER],
            }
        ),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


rule fit_learners:
    input:
        sets=collect("<results>/shifted/{{source}}/seed{seed}.npz", seed=SEEDS),
        code=code_files(
            "gpca.experiments.out_of_distribution.learners",
            *map(explainer_module, LEARNER_SETTINGS),
        ),
    output:
        out=collect(
            "<results>/learners/{{source}}/{learner}/seed{seed}.csv",
            learner=LEARNER_SETTINGS,
            seed=SEEDS,
        ),
    log:
        "<logs>/learners/{source}.log",
    benchmark:
        "<benchmarks>/learners/{source}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.out_of_distribution.learners",
        settings=as_json(LEARNER_SETTINGS),
        learners=list(LEARNER_SETTINGS),
        seeds=SEEDS,
    script:
        "../scripts/step.py"
