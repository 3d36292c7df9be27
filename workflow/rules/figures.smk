rule objects_figure:
    input:
        objects="results/{run}/objects/{source}.npz",
        code=code_files("gpca.reporting.figures.contact_sheet", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/objects_{source}.pdf",
        png=reported("results/{run}/figures/objects_{source}.png"),
    log:
        "results/{run}/logs/figures/objects_{source}.log",
    benchmark:
        "results/{run}/benchmarks/figures/objects_{source}.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=lambda wildcards: title_of(SOURCES[wildcards.source]),
    script:
        "../scripts/contact_sheet.py"


rule fig2_overview:
    input:
        **SHOWN_STAGES,
        code=code_files("gpca.reporting.figures.overview", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/fig2_overview.pdf",
        png=reported("results/{run}/figures/fig2_overview.png"),
    log:
        "results/{run}/logs/figures/fig2_overview.log",
    benchmark:
        "results/{run}/benchmarks/figures/fig2_overview.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=title_of(SOURCES[config["figures"]["source"]]),
        encoder=encoder_title(**config["embedding"]),
        treatments=RECOVERY["treatments"],
    script:
        "../scripts/overview_figure.py"


rule fig3_concepts:
    input:
        objects=f"results/{{run}}/objects/{config['figures']['source']}.npz",
        registrations=f"results/{{run}}/registrations/{config['figures']['source']}/seed{SEEDS[0]}.npz",
        code=code_files("gpca.reporting.figures.concepts", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/fig3_concepts.pdf",
        png=reported("results/{run}/figures/fig3_concepts.png"),
    log:
        "results/{run}/logs/figures/fig3_concepts.log",
    benchmark:
        "results/{run}/benchmarks/figures/fig3_concepts.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=title_of(SOURCES[config["figures"]["source"]]),
    script:
        "../scripts/concepts_figure.py"


rule fig4_pipeline:
    input:
        **SHOWN_STAGES,
        curves=collect(
            "results/{{run}}/active_learning/{source}/{strategy}/seed{seed}.csv",
            source=config["figures"]["source"],
            strategy=SHOWN_STRATEGIES,
            seed=SEEDS,
        ),
        code=code_files("gpca.reporting.figures.pipeline", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/fig4_pipeline.pdf",
        png=reported("results/{run}/figures/fig4_pipeline.png"),
    log:
        "results/{run}/logs/figures/fig4_pipeline.log",
    benchmark:
        "results/{run}/benchmarks/figures/fig4_pipeline.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=title_of(SOURCES[config["figures"]["source"]]),
        encoder=encoder_title(**config["embedding"]),
        batch=config["active_learning"]["batch"],
    script:
        "../scripts/pipeline_figure.py"


rule fig_attribution_confusions:
    input:
        metrics="results/{run}/metrics.csv",
        code=code_files("gpca.reporting.figures.confusions", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/fig_attribution_confusions.pdf",
        png=reported("results/{run}/figures/fig_attribution_confusions.png"),
    log:
        "results/{run}/logs/figures/fig_attribution_confusions.log",
    benchmark:
        "results/{run}/benchmarks/figures/fig_attribution_confusions.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        sources={name: title_of(entry) for name, entry in SOURCES.items()},
        explainers={name: explainer_entry(name).title for name in config["explainers"]},
    script:
        "../scripts/confusions_figure.py"
