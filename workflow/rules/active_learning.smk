rule embeddings_without:
    input:
        registrations="results/{run}/registrations/{source}/seed{seed}.npz",
        code=lambda wildcards: code_files(
            "gpca.steps.without", encoder_module(config["embedding"]["encoder"])
        ),
    output:
        "results/{run}/embeddings/{source}/without/seed{seed}.npz",
    log:
        "results/{run}/logs/embeddings/{source}/without/seed{seed}.log",
    benchmark:
        "results/{run}/benchmarks/embeddings/{source}/without/seed{seed}.tsv"
    priority: 7
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=json.dumps(
            config["encoders"][config["embedding"]["encoder"]]
            | config["active_learning"]["without"],
            sort_keys=True,
        ),
        concepts=config["active_learning"]["held_out"],
    shell:
        "python -m gpca without --threads {threads} --registrations {input.registrations} "
        "--source {wildcards.source} --seed {wildcards.seed} --concepts {params.concepts} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule active_learning:
    input:
        registrations="results/{run}/registrations/{source}/seed{seed}.npz",
        embeddings=f"results/{{run}}/embeddings/{{source}}/{EMBEDDING}/seed{{seed}}.npz",
        without="results/{run}/embeddings/{source}/without/seed{seed}.npz",
        code=code_files("gpca.steps.active_learning"),
    output:
        collect(
            "results/{{run}}/active_learning/{{source}}/{strategy}/seed{{seed}}.csv",
            strategy=STRATEGIES,
        ),
    log:
        "results/{run}/logs/active_learning/{source}/seed{seed}.log",
    benchmark:
        "results/{run}/benchmarks/active_learning/{source}/seed{seed}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("active_learning"),
        strategies=STRATEGIES,
    shell:
        "python -m gpca active_learning --threads {threads} --source {wildcards.source} --seed {wildcards.seed} "
        "--registrations {input.registrations} --embeddings {input.embeddings} "
        "--embeddings-without {input.without} --settings {params.settings:q} "
        "--strategies {params.strategies} --out {output} 2> {log}"


rule active_learning_metrics:
    input:
        curves=learning_curves(STRATEGIES),
        code=code_files("gpca.active_learning.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/active_learning.csv",
    log:
        "results/{run}/logs/active_learning.log",
    benchmark:
        "results/{run}/benchmarks/active_learning.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        target=config["active_learning"]["target"],
    script:
        "../scripts/collect_curves.py"


rule learning_table:
    input:
        metrics="results/{run}/active_learning.csv",
        code=code_files("gpca.reporting.tables.active_learning", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/{table}.csv"),
        md="results/{run}/tables/{table}.md",
        tex="results/{run}/tables/{table}.tex",
    log:
        "results/{run}/logs/tables/{table}.log",
    benchmark:
        "results/{run}/benchmarks/tables/{table}.tsv"
    wildcard_constraints:
        table="|".join(LEARNING_TABLES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        sources=SHOWN_SOURCES,
        strategies=STRATEGY_TITLES,
        conditions=config["active_learning"]
        | {name: config["registrations"][name] for name in ("train", "test")},
    script:
        "../scripts/learning_table.py"


rule active_learning_curves:
    input:
        curves=learning_curves(POOL_STRATEGIES),
        code=code_files("gpca.reporting.figures.active_learning", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/active_learning_curves.pdf",
        png=reported("results/{run}/figures/active_learning_curves.png"),
    log:
        "results/{run}/logs/figures/active_learning_curves.log",
    benchmark:
        "results/{run}/benchmarks/figures/active_learning_curves.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        sources={name: title_of(entry) for name, entry in SOURCES.items()},
        strategies=STRATEGY_TITLES,
        target=config["active_learning"]["target"],
    script:
        "../scripts/learning_curves.py"
