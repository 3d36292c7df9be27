rule kernels:
    input:
        registrations=collect(
            "results/{{run}}/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        embeddings=collect(
            f"results/{{{{run}}}}/embeddings/{{{{source}}}}/{EMBEDDING}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        code=code_files("gpca.steps.kernels"),
    output:
        collect("results/{{run}}/kernels/{{source}}/seed{seed}.csv", seed=SEEDS),
    log:
        "results/{run}/logs/kernels/{source}.log",
    benchmark:
        "results/{run}/benchmarks/kernels/{source}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("kernel_grid"),
        seeds=SEEDS,
    shell:
        "python -m gpca kernels --threads {threads} --source {wildcards.source} --seeds {params.seeds} "
        "--registrations {input.registrations} --embeddings {input.embeddings} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule shift:
    input:
        unpack(shift_inputs),
        code=code_files(
            "gpca.steps.shift", encoder_module(config["embedding"]["encoder"])
        ),
    output:
        collect("results/{{run}}/shifted/{{source}}/seed{seed}.npz", seed=SEEDS),
    log:
        "results/{run}/logs/shifted/{source}.log",
    benchmark:
        "results/{run}/benchmarks/shifted/{source}.tsv"
    priority: 6
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=json.dumps(
            {
                "shift": config["shift"],
                "registrations": config["registrations"],
                "encoder": config["encoders"][config["embedding"]["encoder"]],
            },
            sort_keys=True,
        ),
        seeds=SEEDS,
        other=lambda wildcards, input: (
            ["--other-registrations", *input.other] if input.get("other") else []
        ),
    shell:
        "python -m gpca shift --threads {threads} --source {wildcards.source} --seeds {params.seeds} "
        "--objects {input.objects} --registrations {input.registrations} {params.other} "
        "--embeddings {input.embeddings} --encoders {input.encoders} --settings {params.settings:q} "
        "--out {output} 2> {log}"


rule learn:
    input:
        sets=collect("results/{{run}}/shifted/{{source}}/seed{seed}.npz", seed=SEEDS),
        code=code_files("gpca.steps.learn", *map(explainer_module, config["learners"])),
    output:
        collect(
            "results/{{run}}/learners/{{source}}/{learner}/seed{seed}.csv",
            learner=config["learners"],
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/learners/{source}.log",
    benchmark:
        "results/{run}/benchmarks/learners/{source}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=json.dumps(LEARNER_SETTINGS, sort_keys=True),
        learners=list(LEARNER_SETTINGS),
        seeds=SEEDS,
    shell:
        "python -m gpca learn --threads {threads} --source {wildcards.source} --seeds {params.seeds} "
        "--learners {params.learners} --settings {params.settings:q} --sets {input.sets} "
        "--out {output} 2> {log}"


rule diagnostics:
    input:
        predictions=of_all_learners(),
        sets=collect(
            "results/{{run}}/shifted/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS,
        ),
        code=code_files("gpca.shift.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/diagnostics.csv",
    log:
        "results/{run}/logs/diagnostics.log",
    benchmark:
        "results/{run}/benchmarks/diagnostics.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collect_diagnostics.py"


rule kernel_table:
    input:
        grids=KERNEL_GRIDS,
        code=code_files("gpca.reporting.tables.kernel_grid", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/{table}.csv"),
        md="results/{run}/tables/{table}.md",
        tex="results/{run}/tables/{table}.tex",
    log:
        "results/{run}/logs/tables/{table}.log",
    benchmark:
        "results/{run}/benchmarks/tables/{table}.tsv"
    wildcard_constraints:
        table="|".join(KERNEL_TABLES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        sources=KERNEL_SOURCES,
        test=config["registrations"]["test"],
    script:
        "../scripts/kernel_table.py"


rule learner_table:
    input:
        metrics="results/{run}/diagnostics.csv",
        code=code_files("gpca.reporting.tables.learners", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/{table}.csv"),
        md="results/{run}/tables/{table}.md",
        tex="results/{run}/tables/{table}.tex",
    log:
        "results/{run}/logs/tables/{table}.log",
    benchmark:
        "results/{run}/benchmarks/tables/{table}.tsv"
    wildcard_constraints:
        table="|".join(LEARNER_TABLES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        sources=SHOWN_SOURCES,
        learners=LEARNER_TITLES,
    script:
        "../scripts/learner_table.py"


rule kernel_learning_curves:
    input:
        grids=KERNEL_GRIDS,
        code=code_files("gpca.reporting.figures.kernel_grid", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/kernel_learning_curves.pdf",
        png=reported("results/{run}/figures/kernel_learning_curves.png"),
    log:
        "results/{run}/logs/figures/kernel_learning_curves.log",
    benchmark:
        "results/{run}/benchmarks/figures/kernel_learning_curves.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        sources={name: title_of(entry) for name, entry in KERNEL_SOURCES.items()},
    script:
        "../scripts/kernel_learning_curves.py"


rule learner_figure:
    input:
        predictions=of_all_learners(),
        sets=lambda wildcards: (
            collect(
                f"results/{wildcards.run}/shifted/{{source}}/seed{{seed}}.npz",
                source=SOURCES,
                seed=SEEDS,
            )
            if wildcards.figure == "uncertainty_vs_distance"
            else []
        ),
        code=code_files("gpca.reporting.figures.learners", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/{figure}.pdf",
        png=reported("results/{run}/figures/{figure}.png"),
    log:
        "results/{run}/logs/figures/{figure}.log",
    benchmark:
        "results/{run}/benchmarks/figures/{figure}.tsv"
    wildcard_constraints:
        figure="|".join(LEARNER_FIGURES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        sources={name: title_of(entry) for name, entry in SOURCES.items()},
        learners=LEARNER_TITLES,
    script:
        "../scripts/learner_figure.py"
