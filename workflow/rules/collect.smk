rule metrics:
    input:
        predictions=of_all_explainers("predictions"),
        causal=collect(
            "results/{{run}}/uncertainty/{source}/causal/seed{seed}.csv",
            source=SOURCES,
            seed=SEEDS,
        ),
        code=code_files("gpca.attribution.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/metrics.csv",
    log:
        "results/{run}/logs/metrics.log",
    benchmark:
        "results/{run}/benchmarks/metrics.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collect_metrics.py"


rule timings:
    input:
        timings=of_all_explainers("timings"),
        code=code_files("gpca.attribution.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/timings.csv",
    log:
        "results/{run}/logs/timings.log",
    benchmark:
        "results/{run}/benchmarks/timings.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collect_timings.py"
