rule explain:
    input:
        unpack(explainer_inputs),
        registrations=collect(
            "results/{{run}}/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=lambda wildcards: code_files(
            "gpca.steps.attribute", explainer_module(wildcards.explainer)
        ),
    output:
        predictions=collect(
            "results/{{run}}/predictions/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/predictions/{source}/{explainer}.log",
    benchmark:
        "results/{run}/benchmarks/predictions/{source}/{explainer}.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("explainers", "{explainer}"),
        seeds=SEEDS,
        attached=attached_options,
    shell:
        "python -m gpca attribute --threads {threads} --explainer {wildcards.explainer} "
        "--source {wildcards.source} --seeds {params.seeds} --settings {params.settings:q} "
        "--registrations {input.registrations} {params.attached} --input-timings {input.timings} "
        "--predictions {output.predictions} --timings {output.timings} 2> {log}"
