MODEL_SOURCE, MODEL_ENCODER = config["model"]["source"], config["model"]["encoder"]
MODEL_SHOWN = {**SHOWN_SOURCES, REAL_WORLD: REAL_WORLD_SHOWN}[MODEL_SOURCE]
MODEL_INPUTS = {
    "registrations": f"results/{{run}}/registrations/{MODEL_SOURCE}/seed{SEEDS[0]}.npz",
    "embeddings": f"results/{{run}}/embeddings/{MODEL_SOURCE}/{MODEL_ENCODER}/none/seed{SEEDS[0]}.npz",
}


rule model:
    input:
        **MODEL_INPUTS,
        encoder=f"results/{{run}}/encoders/{MODEL_SOURCE}/{MODEL_ENCODER}/seed{SEEDS[0]}.pt",
        code=code_files("gpca.steps.model", encoder_module(MODEL_ENCODER)),
    output:
        "results/{run}/model.pt",
    log:
        "results/{run}/logs/model.log",
    benchmark:
        "results/{run}/benchmarks/model.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        title=MODEL_SHOWN["title"],
        stand_in="--stand-in" if MODEL_SHOWN["stand_in"] else "",
        settings=json.dumps(
            {
                "encoder": config["encoders"][MODEL_ENCODER],
                "gpc": config["explainers"].get("gpca") or {},
                "registrations": {
                    name: config["registrations"][name] for name in ("cloud_points", "icp")
                },
                "recovery": {
                    "thresholds": RECOVERY["thresholds"],
                    "treatments": RECOVERY["treatments"],
                    "loop": {"budget": RECOVERY["loop"]["budget"]},
                },
            },
            sort_keys=True,
        ),
    shell:
        "python -m gpca model --threads {threads} --source {params.source} --seed {params.seed} "
        "--title {params.title:q} {params.stand_in} --registrations {input.registrations} --encoder {input.encoder} "
        "--embeddings {input.embeddings} --settings {params.settings:q} --out {output} 2> {log}"


rule runtime:
    input:
        **MODEL_INPUTS,
        model="results/{run}/model.pt",
        code=code_files("gpca.steps.runtime", encoder_module(MODEL_ENCODER)),
    output:
        "results/{run}/runtime.csv",
    log:
        "results/{run}/logs/runtime.log",
    benchmark:
        "results/{run}/benchmarks/runtime.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 2  # it works on one; with -j2 nothing else runs beside it, for it measures times
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        settings=json.dumps(
            {name: config[name] for name in ("runtime", "active_learning")},
            sort_keys=True,
        ),
    shell:
        "python -m gpca runtime --threads 1 --source {params.source} --seed {params.seed} "
        "--model {input.model} --registrations {input.registrations} --embeddings {input.embeddings} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule table7_runtime:
    input:
        runtime="results/{run}/runtime.csv",
        published=PUBLISHED_NUMBERS,
        code=code_files("gpca.reporting.tables.runtime", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/table7_runtime.csv"),
        md="results/{run}/tables/table7_runtime.md",
        tex="results/{run}/tables/table7_runtime.tex",
    log:
        "results/{run}/logs/tables/table7_runtime.log",
    benchmark:
        "results/{run}/benchmarks/tables/table7_runtime.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        title=title_of(MODEL_SHOWN),
    script:
        "../scripts/runtime_table.py"


rule runtime_figure:
    input:
        runtime="results/{run}/runtime.csv",
        published=PUBLISHED_NUMBERS,
        code=code_files("gpca.reporting.figures.runtime", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/runtime.pdf",
        png=reported("results/{run}/figures/runtime.png"),
    log:
        "results/{run}/logs/figures/runtime.log",
    benchmark:
        "results/{run}/benchmarks/figures/runtime.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        title=title_of(MODEL_SHOWN),
    script:
        "../scripts/runtime_figure.py"
