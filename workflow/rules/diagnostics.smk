# The classifier's kernels and schedules (Table IV); learners on samples unlike those of the training (Table V).
ENCODER = config["embedding"]["encoder"]
# A learner that is an explainer of the config too has its settings, and those of its own besides.
LEARNER_SETTINGS = {
    name: (config["explainers"].get(name) or {}) | (own or {})
    for name, own in config["learners"].items()
}


rule fit_kernel_grid:
    input:
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        embeddings=collect(
            f"<results>/embeddings/{{{{source}}}}/{EMBEDDING}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        code=code_files("gpca.experiments.kernel_grid.step"),
    output:
        out=collect("<results>/kernels/{{source}}/seed{seed}.csv", seed=SEEDS),
    log:
        "<logs>/kernels/{source}.log",
    benchmark:
        "<benchmarks>/kernels/{source}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        step="gpca.experiments.kernel_grid.step",
        settings=settings("kernel_grid"),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


rule kernels:
    input:
        files=collect(
            "<results>/kernels/{source}/seed{seed}.csv",
            source=NAMES["kernel_source"],
            seed=SEEDS,
        ),
        code=collector_code("gpca.experiments.kernel_grid.grid:collect_grids"),
    output:
        "<results>/kernels.csv",
    log:
        "<logs>/kernels.log",
    benchmark:
        "<benchmarks>/kernels.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.experiments.kernel_grid.grid:collect_grids",
    script:
        "../scripts/collect.py"


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
    resources:
        mem_mb=3000,
        runtime=60,
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
            "gpca.experiments.out_of_distribution.learners_step",
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
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        step="gpca.experiments.out_of_distribution.learners_step",
        settings=as_json(LEARNER_SETTINGS),
        learners=list(LEARNER_SETTINGS),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


rule diagnostics:
    input:
        prediction_files=rules.learners.input,
        set_files=rules.shifted.input,
        code=collector_code(
            "gpca.experiments.out_of_distribution.metrics:collect_diagnostics"
        ),
    output:
        "<results>/diagnostics.csv",
    log:
        "<logs>/diagnostics.log",
    benchmark:
        "<benchmarks>/diagnostics.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.experiments.out_of_distribution.metrics:collect_diagnostics",
    script:
        "../scripts/collect.py"
