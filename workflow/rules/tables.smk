rule table:
    input:
        unpack(table_inputs),
        code=code_files(
            "gpca.attribution.metrics", "gpca.reporting.tables.explainers", "gpca.reporting.script"
        ),
    output:
        csv=reported("results/{run}/tables/{table}.csv"),
        md="results/{run}/tables/{table}.md",
        tex="results/{run}/tables/{table}.tex",
    log:
        "results/{run}/logs/tables/{table}.log",
    benchmark:
        "results/{run}/benchmarks/tables/{table}.tsv"
    wildcard_constraints:
        table="|".join(TABLE_EXPLAINERS),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        sources=SHOWN_SOURCES,
        explainers=lambda wildcards: {
            name: {"title": entry.title, "oracle": entry.oracle}
            for name in TABLE_EXPLAINERS[wildcards.table]
            for entry in [explainer_entry(name)]
        },
    script:
        "../scripts/table.py"
