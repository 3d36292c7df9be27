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


rule embeddings:
    input:
        registrations="results/{run}/registrations/{source}/seed{seed}.npz",
        timings="results/{run}/timings/{source}/icp/seed{seed}.csv",
        weights="results/{run}/encoders/{source}/{backbone}/seed{seed}.pt",
        code=encoder_code("embed"),
    output:
        embeddings="results/{run}/embeddings/{source}/{backbone}/none/seed{seed}.npz",
        timings="results/{run}/timings/{source}/{backbone}/seed{seed}.csv",
    log:
        "results/{run}/logs/embeddings/{source}/{backbone}/seed{seed}.log",
    benchmark:
        "results/{run}/benchmarks/embeddings/{source}/{backbone}/seed{seed}.tsv"
    priority: 5
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=settings("encoders", "{backbone}"),
    shell:
        "python -m gpca embed --threads {threads} --registrations {input.registrations} "
        "--registration-timings {input.timings} --encoder {input.weights} "
        "--source {wildcards.source} --seed {wildcards.seed} --settings {params.settings:q} "
        "--out {output.embeddings} --timings {output.timings} 2> {log}"
