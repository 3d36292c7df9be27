rule encoder:
    input:
        registrations="results/{run}/registrations/{source}/seed{seed}.npz",
        code=encoder_code("train"),
    output:
        weights="results/{run}/encoders/{source}/{backbone}/seed{seed}.pt",
        curve="results/{run}/encoders/{source}/{backbone}/seed{seed}.csv",
    log:
        "results/{run}/logs/encoders/{source}/{backbone}/seed{seed}.log",
    benchmark:
        "results/{run}/benchmarks/encoders/{source}/{backbone}/seed{seed}.tsv"
    # The longest jobs go first, so that none of them is left over while the other cores wait.
    priority: 10
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("encoders", "{backbone}"),
    shell:
        "python -m gpca train --threads {threads} --registrations {input.registrations} "
        "--source {wildcards.source} --seed {wildcards.seed} --settings {params.settings:q} "
        "--out {output.weights} --curve {output.curve} 2> {log}"


# All seeds in one job: embedding takes less time per seed than importing torch.
rule embeddings:
    input:
        registrations=collect(
            "results/{{run}}/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/icp/seed{seed}.csv", seed=SEEDS
        ),
        encoders=collect(
            "results/{{run}}/encoders/{{source}}/{{backbone}}/seed{seed}.pt",
            seed=SEEDS,
        ),
        code=encoder_code("embed"),
    output:
        embeddings=collect(
            "results/{{run}}/embeddings/{{source}}/{{backbone}}/none/seed{seed}.npz",
            seed=SEEDS,
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/{{backbone}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/embeddings/{source}/{backbone}.log",
    benchmark:
        "results/{run}/benchmarks/embeddings/{source}/{backbone}.tsv"
    priority: 5
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("encoders", "{backbone}"),
        seeds=SEEDS,
    shell:
        "python -m gpca embed --threads {threads} --source {wildcards.source} --seeds {params.seeds} "
        "--settings {params.settings:q} --registrations {input.registrations} "
        "--registration-timings {input.timings} --encoders {input.encoders} "
        "--out {output.embeddings} --timings {output.timings} 2> {log}"
