# One file with all that an explanation needs, and the seconds of its stages.
MODEL_SOURCE, MODEL_ENCODER = config["model"]["source"], config["model"]["encoder"]
MODEL_INPUTS = {
    "registrations": f"<results>/registrations/{MODEL_SOURCE}/seed{SEEDS[0]}.npz",
    "embeddings": f"<results>/embeddings/{MODEL_SOURCE}/{MODEL_ENCODER}/none/seed{SEEDS[0]}.npz",
}
MODEL_SETTINGS = {
    "encoder": config["encoders"][MODEL_ENCODER],
    "gpc": config["explainers"].get("gpca") or {},
    "registrations": {
        name: config["registrations"][name] for name in ("cloud_points", "icp")
    },
    "causes": config["causes"],
    "descriptors": DIAGNOSIS["descriptors"],
    "model": {
        name: config["model"][name] for name in ("causes", "classifier", "false_alarms")
    },
    "recovery": {
        "thresholds": config["recovery"]["thresholds"],
        "treatments": config["recovery"]["treatments"],
        "loop": {"budget": config["recovery"]["loop"]["budget"]},
    },
}


use rule sample_causes as sample_model_causes with:
    output:
        causes="<results>/model_causes/{source}/seed{seed}.npz",
        candidates="<results>/model_causes/{source}/seed{seed}.csv",
        timings="<results>/timings/{source}/model_causes/seed{seed}.csv",
    log:
        "<logs>/model_causes/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/model_causes/{source}/seed{seed}.tsv"
    params:
        settings=as_json(config["causes"] | config["model"]["causes"] | ICP),


use rule describe as describe_model_causes with:
    input:
        causes="<results>/model_causes/{source}/seed{seed}.npz",
        causes_timings="<results>/timings/{source}/model_causes/seed{seed}.csv",
        code=code_files("gpca.steps.describe"),
    output:
        descriptors="<results>/model_descriptors/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/model_descriptors/seed{seed}.csv",
    log:
        "<logs>/model_descriptors/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/model_descriptors/{source}/seed{seed}.tsv"


rule model:
    input:
        **MODEL_INPUTS,
        encoder=f"<results>/encoders/{MODEL_SOURCE}/{MODEL_ENCODER}/seed{SEEDS[0]}.pt",
        causes=collect(
            "<results>/model_causes/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS[0],
        ),
        descriptors=collect(
            "<results>/model_descriptors/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS[0],
        ),
        code=code_files("gpca.steps.model", encoder_module(MODEL_ENCODER)),
    output:
        out="<results>/model.pt",
    log:
        "<logs>/model.log",
    benchmark:
        "<benchmarks>/model.tsv"
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        step="gpca.steps.model",
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        title=SHOWN["model"]["title"],
        stand_in=SHOWN["model"]["stand_in"],
        settings=as_json(MODEL_SETTINGS),
    script:
        "../scripts/step.py"


rule time_stages:
    input:
        **MODEL_INPUTS,
        model="<results>/model.pt",
        code=code_files("gpca.experiments.runtime.step", encoder_module(MODEL_ENCODER)),
    output:
        out="<results>/runtime.csv",
    log:
        "<logs>/runtime.log",
    benchmark:
        "<benchmarks>/runtime.tsv"
    conda:
        "../envs/gpca.yaml"
    # It works on one thread but reserves the whole machine, since it measures times; on a cluster the profile does that.
    threads: workflow.resource_settings.cores or 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        step="gpca.experiments.runtime.step",
        threads=1,
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        settings=as_json(
            {name: config[name] for name in ("runtime", "active_learning")}
        ),
    script:
        "../scripts/step.py"
