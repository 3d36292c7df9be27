# The numbers that the paper prints beside those of the run, and the page of the run.
from gpca.comparison.published import read_published

COLLECTED = [
    *("metrics.csv", "timings.csv", "active_learning.csv", "real_world.csv"),
    *("diagnostics.csv", "kernels.csv", "recovery.csv", "runtime.csv"),
    "controls.csv",
]
# Those of them that hold a counterpart of a printed number.
COMPARED = sorted(
    {number.counterpart.file for number in read_published() if number.counterpart}
    & set(COLLECTED)
)
# Sources whose first registrations the page shows in 3-D -> the form of GP-CA that explains them there.
SAMPLED = {source: NAMES["gpca"] for source in SOURCES if NAMES["gpca"]}
SAMPLED |= {FRAMES: NAMES["first_backbone"]}


rule comparison:
    input:
        collected=[f"<results>/{name}" for name in COMPARED],
        code=code_files(
            "gpca.comparison.verdicts",
            "gpca.reporting.tables.comparison",
            "gpca.reporting.script",
        ),
    output:
        csv="<results>/comparison.csv",
        md="<results>/comparison.md",
    log:
        "<logs>/comparison.log",
    benchmark:
        "<benchmarks>/comparison.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        objects={**SHOWN["sources"], FRAMES: SHOWN["frames"], "model": SHOWN["model"]},
        tolerances=config["comparison"]["tolerances"],
    script:
        "../scripts/comparison.py"


rule page:
    input:
        comparison="<results>/comparison.csv",
        results=[f"<results>/{file}" for result in RESULTS for file in result.all_files],
        registrations=collect(
            f"<results>/registrations/{{source}}/seed{SEEDS[0]}.npz", source=SAMPLED
        ),
        predictions=[
            f"<results>/predictions/{source}/{explainer}/seed{SEEDS[0]}.csv"
            for source, explainer in SAMPLED.items()
        ],
        code=code_files("gpca.reporting.page.page", "gpca.reporting.script"),
    output:
        page="<results>/index.html",
        script="<results>/page/plotly.min.js",
    log:
        "<logs>/page.log",
    benchmark:
        "<benchmarks>/page.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        run=config["run"],
        shown=[
            (result.name, result.kind, result.section, result.title, result.caption)
            for result in RESULTS
        ],
        samples=list(SAMPLED),
        sources={**SHOWN["sources"], FRAMES: SHOWN["frames"]},
        # Not where data lie: that changes no number, and is nobody's business.
        config={
            key: value
            for key, value in config.items()
            if key not in ("data_dir", "downloads")
        },
    script:
        "../scripts/page.py"
