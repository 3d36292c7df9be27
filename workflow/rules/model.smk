# One file with all that an explanation needs.
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
    "reenactment": DIAGNOSIS["reenactment"],
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


use rule reenact as reenact_model_causes with:
    input:
        causes="<results>/model_causes/{source}/seed{seed}.npz",
        causes_timings="<results>/timings/{source}/model_causes/seed{seed}.csv",
        code=code_stamp("gpca.steps.causes:reenact"),
    output:
        reenactments="<results>/model_reenactments/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/model_reenactments/seed{seed}.csv",
    log:
        "<logs>/model_reenactments/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/model_reenactments/{source}/seed{seed}.tsv"
    params:
        settings=as_json(
            {
                "reenactment": DIAGNOSIS["reenactment"],
                "causes": config["causes"] | config["model"]["causes"],
            }
            | ICP
        ),


rule model:
    input:
        **MODEL_INPUTS,
        encoder=f"<results>/encoders/{MODEL_SOURCE}/{MODEL_ENCODER}/seed{SEEDS[0]}.pt",
        objects=collect("<results>/objects/{source}.npz", source=SOURCES),
        causes=collect(
            "<results>/model_causes/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS[0],
        ),
        reenactments=collect(
            "<results>/model_reenactments/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS[0],
        ),
        code=code_stamp("gpca.steps.causes:model", encoder_module(MODEL_ENCODER)),
    output:
        out="<results>/model.pt",
    log:
        "<logs>/model.log",
    benchmark:
        "<benchmarks>/model.tsv"
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=6000,  # 4500 in the full protocol
    params:
        step="gpca.steps.causes:model",
        title=TITLED["model"]["title"],
        stand_in=TITLED["model"]["stand_in"],
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        learned_from=[
            of["title"] + " (procedural stand-in)" * of["stand_in"]
            for of in (TITLED[source] for source in SOURCES)
        ],
        settings=as_json(MODEL_SETTINGS),
    script:
        "../scripts/step.py"
