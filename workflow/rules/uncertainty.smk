rule uncertainty:
    input:
        registrations=collect(
            "results/{{run}}/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=code_files("gpca.steps.uncertainty"),
    output:
        outcomes=collect(
            "results/{{run}}/uncertainty/{{source}}/{{design}}/seed{seed}.npz",
            seed=SEEDS,
        ),
        tables=collect(
            "results/{{run}}/uncertainty/{{source}}/{{design}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/uncertainty_{{design}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/uncertainty/{source}/{design}.log",
    benchmark:
        "results/{run}/benchmarks/uncertainty/{source}/{design}.tsv"
    priority: 3
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        settings=lambda wildcards: json.dumps(
            config["uncertainty"][wildcards.design]
            | {"icp": config["registrations"]["icp"]},
            sort_keys=True,
        ),
        seeds=SEEDS,
    shell:
        "python -m gpca uncertainty --threads {threads} --design {wildcards.design} "
        "--source {wildcards.source} --seeds {params.seeds} --settings {params.settings:q} "
        "--registrations {input.registrations} --out {output.outcomes} --tables {output.tables} "
        "--timings {output.timings} 2> {log}"
