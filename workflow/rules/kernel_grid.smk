# Embeddings -> the GPC with every kernel and schedule -> kernels.csv.
rule fit_kernel_grid:
    input:
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        embeddings=collect(
            f"<results>/embeddings/{{{{source}}}}/{EMBEDDING}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        code=code_files("gpca.steps.kernel_grid"),
    output:
        collect("<results>/kernels/{{source}}/seed{seed}.csv", seed=SEEDS),
    log:
        "<logs>/kernels/{source}.log",
    benchmark:
        "<benchmarks>/kernels/{source}.tsv"
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
        "python -m gpca kernel_grid --threads {threads} --source {wildcards.source} --seeds {params.seeds} "
        "--registrations {input.registrations} --embeddings {input.embeddings} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule kernels:
    input:
        files=collect(
            "<results>/kernels/{source}/seed{seed}.csv",
            source=NAMES["kernel_source"],
            seed=SEEDS,
        ),
        code=collector_code("gpca.classifier.kernel_metrics:collect_grids"),
    output:
        "<results>/kernels.csv",
    log:
        "<logs>/kernels.log",
    benchmark:
        "<benchmarks>/kernels.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        collector="gpca.classifier.kernel_metrics:collect_grids",
    script:
        "../scripts/collect.py"
