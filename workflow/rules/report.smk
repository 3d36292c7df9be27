report: "../report/workflow.rst"


SHOWN = {
    folder: [Path(file).stem for file in RESULTS if file.startswith(folder)]
    for folder in ("tables", "figures")
}
# Whose first registrations the page shows in 3-D, and by which form of GP-CA.
SAMPLED = {name: "gpca" for name in SOURCES if "gpca" in config["explainers"]}
SAMPLED |= {REAL_WORLD: name for name in BACKBONES[:1]}
SAMPLES = {
    source: (
        f"results/{{run}}/registrations/{source}/seed{SEEDS[0]}.npz",
        f"results/{{run}}/predictions/{source}/{explainer}/seed{SEEDS[0]}.csv",
    )
    for source, explainer in SAMPLED.items()
}


rule page:
    input:
        results=[f"results/{{run}}/{file}" for file in RESULTS if file != "index.html"],
        samples=[file for files in SAMPLES.values() for file in files],
        captions=caption_files("workflow/report", SHOWN["tables"] + SHOWN["figures"]),
        code=[
            *code_files("gpca.reporting.page.page", "gpca.reporting.script"),
            *map(str, sorted(Path("gpca/reporting/page/templates").iterdir())),
        ],
    output:
        page="results/{run}/index.html",
        script="results/{run}/page/plotly.min.js",
    log:
        "results/{run}/logs/page.log",
    benchmark:
        "results/{run}/benchmarks/page.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        shown=SHOWN,
        samples=lambda wildcards: {
            source: [file.format(run=wildcards.run) for file in files]
            for source, files in SAMPLES.items()
        },
        sources={**SHOWN_SOURCES, REAL_WORLD: REAL_WORLD_SHOWN},
        # Not where data lie: that changes no number, and is nobody's business.
        config={
            key: value
            for key, value in config.items()
            if key not in ("data_dir", "downloads")
        },
    script:
        "../scripts/page.py"


# `snakemake --report` of this very run, by a Snakemake of its own: what is missing is made first.
rule report:
    input:
        [f"results/{config['run']}/{file}" for file in RESULTS],
    output:
        f"results/{config['run']}/report.html",
    log:
        text=f"results/{config['run']}/logs/report.log",
        config=f"results/{config['run']}/logs/report.json",
    benchmark:
        f"results/{config['run']}/benchmarks/report.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        config=json.dumps(GIVEN_CONFIG, sort_keys=True),
    shell:
        "(printf '%s' {params.config:q} > {log.config} && python -m snakemake all --report {output} "
        "--configfile {log.config} --nolock) > {log.text} 2>&1"
