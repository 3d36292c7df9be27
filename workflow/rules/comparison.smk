# The collected files that have a counterpart of a printed number and that this run makes.
COMPARED = sorted(
    {
        number.counterpart.file
        for number in read_published()
        if number.counterpart and number.counterpart.file in RESULTS
    }
)


rule kernel_metrics:
    input:
        grids=KERNEL_GRIDS,
        code=code_files("gpca.classifier.kernel_metrics", "gpca.reporting.script"),
    output:
        "results/{run}/kernels.csv",
    log:
        "results/{run}/logs/kernels.log",
    benchmark:
        "results/{run}/benchmarks/kernels.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collect_kernels.py"


rule comparison:
    input:
        collected=[f"results/{{run}}/{name}" for name in COMPARED],
        published=PUBLISHED_NUMBERS,
        reasons=os.path.relpath(REASONS),
        code=code_files(
            "gpca.comparison.verdicts",
            "gpca.reporting.tables.comparison",
            "gpca.reporting.script",
        ),
    output:
        csv="results/{run}/comparison.csv",
        md="results/{run}/comparison.md",
    log:
        "results/{run}/logs/comparison.log",
    benchmark:
        "results/{run}/benchmarks/comparison.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        objects={**SHOWN_SOURCES, REAL_WORLD: REAL_WORLD_SHOWN, "model": MODEL_SHOWN},
        tolerances=config["comparison"]["tolerances"],
    script:
        "../scripts/comparison.py"
