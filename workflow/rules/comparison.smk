# The numbers that the paper prints beside those of the run, and the page of the run.
from gpca.comparison.claims import counterparts_of, read_claims
from gpca.comparison.published import read_published
from gpca.comparison.values import folders_behind
from gpca.experiments.diagnosis import cause_titles
from gpca.experiments.shifts import shifts
from gpca.declarations.registry import experiments
from gpca.frames.source import ONE_ENCODER

COLLECTED = [
    file
    for each in experiments()
    if each.is_run(NAMES)
    for tidy in each.tidy
    for file in tidy.all_files
]
ENDS = ["model.pt", "comparison.md", "index.html"]
PUBLISHED = read_published()
# What stands beside printed numbers and sentences.
COUNTERPARTS = [number.counterpart for number in PUBLISHED if number.counterpart]
COUNTERPARTS += counterparts_of(read_claims())
COMPARED = sorted({counterpart.file for counterpart in COUNTERPARTS} & set(COLLECTED))
# Predictions of single samples that these are shares of, where the config makes them.
PREDICTED = {
    *(
        ("predictions", source, name)
        for source in SOURCES
        for name in config["explainers"]
    ),
    *(("predictions", FRAMES, name) for name in NAMES["backbone"]),
    *(("learners", source, name) for source in SOURCES for name in NAMES["learner"]),
}
COMPARED_PREDICTIONS = [
    f"<results>/{'/'.join(folder)}/seed{seed}.csv"
    for folder in folders_behind(COUNTERPARTS)
    if folder in PREDICTED
    for seed in (FRAME_SEEDS if folder[1] == FRAMES else SEEDS)
]
# Sources whose first failures the page shows with their measured causes.
MEASURED = SOURCES if NAMES["cause_explainer"] else []
# What the page says first comes from these.
FOUND = [
    *("attribution_intervals.csv", "cause_intervals.csv"),
    *("real_world_intervals.csv", "active_learning.csv", "recovery_intervals.csv"),
]
ROOT_OF_RUN = Path("results", config["run"])


onsuccess:
    if (ROOT_OF_RUN / "index.html").is_file():
        print(f"The page of the run: {ROOT_OF_RUN / 'index.html'}", file=sys.stderr)


rule comparison:
    input:
        collected=[f"<results>/{name}" for name in COMPARED],
        predictions=COMPARED_PREDICTIONS,
        readings="<results>/readings.csv",
        code=code_stamp(
            "gpca.comparison.claims",
            "gpca.comparison.readings",
            "gpca.experiments.reading_words",
            "gpca.comparison.markdown",
            "gpca.jobs.job",
        ),
    output:
        csv="<results>/comparison.csv",
        md="<results>/comparison.md",
        claims="<results>/claims.csv",
        readings="<results>/reading_verdicts.csv",
    log:
        "<logs>/comparison.log",
    benchmark:
        "<benchmarks>/comparison.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    params:
        objects={name: entry for name, entry in TITLED.items() if name != ONE_ENCODER},
        tolerances=config["comparison"]["tolerances"],
        floors={"labels": 1},
    script:
        "../scripts/comparison.py"


rule page:
    input:
        comparison="<results>/comparison.csv",
        found=[f"<results>/{name}" for name in FOUND],
        results=[f"<results>/{file}" for result in RESULTS for file in result.all_files],
        objects=collect("<results>/objects/{source}.npz", source=MEASURED),
        causes=collect(
            f"<results>/causes/{{source}}/seed{SEEDS[0]}.npz", source=MEASURED
        ),
        code=code_stamp("gpca.page.page", "gpca.page.crate", "gpca.jobs.job"),
    output:
        page="<results>/index.html",
        crate="<results>/ro-crate-metadata.json",
    log:
        "<logs>/page.log",
    benchmark:
        "<benchmarks>/page.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    params:
        run=config["run"],
        shown=[
            (result.name, result.kind, result.section, result.title, result.caption)
            for result in RESULTS
        ],
        measured=MEASURED,
        titles={
            "explainers": {
                name: {"title": entry.title, "oracle": entry.oracle}
                for name in config["explainers"]
                for entry in [explainer_entry(name)]
            },
            "cause_explainers": cause_titles(config),
            "shifts": shifts(config),
            "budget": config["recovery"]["loop"]["budget"],
        },
        sources={name: TITLED[name] for name in (*SOURCES, FRAMES)},
        # Not where data lie: that changes no number, and is nobody's business.
        config={
            key: value
            for key, value in config.items()
            if key not in ("data_dir", "downloads")
        },
    script:
        "../scripts/page.py"
