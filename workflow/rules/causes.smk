# Canonical clouds -> registrations whose causes of failure are measured.
rule causes:
    input:
        collect(
            "<results>/causes/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS,
        ),


rule sample_causes:
    input:
        objects="<results>/objects/{source}.npz",
        code=code_files("gpca.steps.causes"),
    output:
        causes="<results>/causes/{source}/seed{seed}.npz",
        candidates="<results>/causes/{source}/seed{seed}.csv",
        timings="<results>/timings/{source}/causes/seed{seed}.csv",
    log:
        "<logs>/causes/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/causes/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        settings=as_json(config["causes"] | {"icp": config["registrations"]["icp"]}),
    shell:
        "python -m gpca causes --threads {threads} --objects {input.objects} --source {wildcards.source} "
        "--seed {wildcards.seed} --settings {params.settings:q} --out {output.causes} "
        "--candidates {output.candidates} --timings {output.timings} 2> {log}"
