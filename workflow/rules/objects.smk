rule objects:
    input:
        data=lambda wildcards: data_files(SOURCES[wildcards.source]),
        code=objects_code,
    output:
        "results/{run}/objects/{source}.npz",
    log:
        "results/{run}/logs/objects/{source}.log",
    benchmark:
        "results/{run}/benchmarks/objects/{source}.tsv"
    wildcard_constraints:
        source="|".join(CONFIGURED_SOURCES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=lambda wildcards: json.dumps(
            config["sources"][wildcards.source], sort_keys=True
        ),
        data=data_option,
        surface_points=config["objects"]["surface_points"],
    shell:
        "python -m gpca objects --threads {threads} --source {wildcards.source} --settings {params.settings:q} "
        "{params.data} --surface-points {params.surface_points} --out {output} 2> {log}"
