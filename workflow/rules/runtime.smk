# The model -> the seconds of every stage of an explanation (Table VII).
rule time_stages:
    input:
        **MODEL_INPUTS,
        model="<results>/model.pt",
        code=code_stamp("gpca.steps.runtime", encoder_module(MODEL_ENCODER)),
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
    params:
        step="gpca.steps.runtime",
        threads=1,
        source=MODEL_SOURCE,
        seed=SEEDS[0],
        settings=as_json(
            {"runtime": config["runtime"], "active_learning": LEARNING_SETTINGS}
        ),
    script:
        "../scripts/step.py"
