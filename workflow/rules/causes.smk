# Canonical clouds -> registrations whose causes of failure are measured -> what explainers of them read.
DIAGNOSIS = config["diagnosis"]
ICP = {"icp": config["registrations"]["icp"]}


rule causes:
    input:
        collect("<results>/causes/{source}/seed{seed}.npz", source=SOURCES, seed=SEEDS),


rule sample_causes:
    input:
        objects="<results>/objects/{source}.npz",
        code=code_stamp("gpca.steps.causes:causes"),
    output:
        causes="<results>/causes/{source}/seed{seed}.npz",
        candidates="<results>/causes/{source}/seed{seed}.csv",
        timings="<results>/timings/{source}/causes/seed{seed}.csv",
    log:
        "<logs>/causes/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/causes/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.causes:causes",
        settings=as_json(config["causes"] | ICP),
    script:
        "../scripts/step.py"


rule describe:
    input:
        causes="<results>/causes/{source}/seed{seed}.npz",
        causes_timings="<results>/timings/{source}/causes/seed{seed}.csv",
        code=code_stamp("gpca.steps.causes:describe"),
    output:
        descriptors="<results>/descriptors/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/descriptors/seed{seed}.csv",
    log:
        "<logs>/descriptors/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/descriptors/{source}/seed{seed}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.causes:describe",
        settings=as_json(DIAGNOSIS["descriptors"] | ICP),
    script:
        "../scripts/step.py"


rule reenact:
    input:
        causes="<results>/causes/{source}/seed{seed}.npz",
        causes_timings="<results>/timings/{source}/causes/seed{seed}.csv",
        code=code_stamp("gpca.steps.causes:reenact"),
    output:
        reenactments="<results>/reenactments/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/reenactments/seed{seed}.csv",
    log:
        "<logs>/reenactments/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/reenactments/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.causes:reenact",
        settings=as_json(
            {"reenactment": DIAGNOSIS["reenactment"], "causes": config["causes"]} | ICP
        ),
    script:
        "../scripts/step.py"


rule train_on_causes:
    input:
        causes="<results>/causes/{source}/seed{seed}.npz",
        causes_timings="<results>/timings/{source}/causes/seed{seed}.csv",
        code=code_stamp(
            "gpca.steps.causes:train_on_causes", backbone_module(DIAGNOSIS["encoder"])
        ),
    output:
        weights="<results>/cause_encoders/{source}/seed{seed}.pt",
        curve="<results>/cause_encoders/{source}/seed{seed}.csv",
        embeddings="<results>/cause_embeddings/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/cause_embeddings/seed{seed}.csv",
    log:
        "<logs>/cause_encoders/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/cause_encoders/{source}/seed{seed}.tsv"
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.causes:train_on_causes",
        settings=as_json(DIAGNOSIS["encoder"]),
    script:
        "../scripts/step.py"
