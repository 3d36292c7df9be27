# Embeddings -> scores of every kernel and schedule of the classifier (Table IV).
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
        predictions=collect(
            "<results>/kernel_predictions/{{source}}/seed{seed}.csv", seed=SEEDS
        ),
    log:
        "<logs>/kernels/{source}.log",
    benchmark:
        "<benchmarks>/kernels/{source}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.kernel_grid.step",
        settings=settings("kernel_grid"),
        seeds=SEEDS,
    script:
        "../scripts/step.py"
