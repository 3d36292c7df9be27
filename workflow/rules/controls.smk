# Registrations -> encoders trained under a control -> what every explainer says under all of them.
from gpca.experiments.controls.settings import HARD, OF_EVERY_SEED, RETRAINED, TRAININGS

CONTROLS = config["controls"]
CONTROL_SEEDS = NAMES["control_seed"]
CONTROL_ENCODER = config["embedding"]["encoder"]
CONTROL_EXPLAINERS = {
    name: (config["explainers"].get(name) or {}) | (own or {})
    for name, own in CONTROLS["explainers"].items()
}


rule controls:
    input:
        collect(
            "<results>/controls/{source}/seed{seed}.csv",
            source=SOURCES,
            seed=CONTROL_SEEDS,
        ),


use rule sample_causes as sample_hard with:
    output:
        causes="<results>/hard/{source}/seed{seed}.npz",
        candidates="<results>/hard/{source}/seed{seed}.csv",
        timings="<results>/timings/{source}/hard/seed{seed}.csv",
    log:
        "<logs>/hard/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/hard/{source}/seed{seed}.tsv"
    params:
        settings=as_json(config["causes"] | CONTROLS["hard"] | ICP),


rule train_control:
    input:
        registrations=lambda wildcards: samples_of_control(wildcards),
        code=code_files(
            "gpca.experiments.controls.encoding", encoder_module(CONTROL_ENCODER)
        ),
    output:
        embeddings="<results>/control_embeddings/{control}/{source}/seed{seed}.npz",
        curve="<results>/control_embeddings/{control}/{source}/seed{seed}.csv",
    log:
        "<logs>/control_embeddings/{control}/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/control_embeddings/{control}/{source}/seed{seed}.tsv"
    wildcard_constraints:
        control="|".join([*RETRAINED, *TRAININGS]),
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.controls.encoding",
        settings=lambda wildcards: control_settings(wildcards),
    script:
        "../scripts/step.py"


rule explain_controls:
    input:
        objects="<results>/objects/{source}.npz",
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        other_registrations=lambda wildcards: collect(
            f"<results>/registrations/{{source}}/seed{wildcards.seed}.npz",
            source=other_sources(wildcards),
        ),
        hard=lambda wildcards: hard_samples(wildcards),
        encoder=f"<results>/encoders/{{source}}/{CONTROL_ENCODER}/seed{{seed}}.pt",
        embeddings=f"<results>/embeddings/{{source}}/{CONTROL_ENCODER}/none/seed{{seed}}.npz",
        retrained_embeddings=lambda wildcards: collect(
            f"<results>/control_embeddings/{{control}}/{wildcards.source}/seed{wildcards.seed}.npz",
            control=retrained(wildcards),
        ),
        code=code_files(
            "gpca.experiments.controls.step",
            encoder_module(CONTROL_ENCODER),
            *map(explainer_module, CONTROL_EXPLAINERS),
        ),
    output:
        predictions="<results>/controls/{source}/seed{seed}.csv",
        samples="<results>/control_samples/{source}/seed{seed}.csv",
        timings="<results>/timings/{source}/controls/seed{seed}.csv",
    log:
        "<logs>/controls/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/controls/{source}/seed{seed}.tsv"
    priority: 5
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.controls.step",
        settings=lambda wildcards: control_settings(
            wildcards,
            explainers=CONTROL_EXPLAINERS,
            uncertainty=config["uncertainty"].get("removal", {}),
            icp=config["registrations"]["icp"],
        ),
        retrained=retrained,
        others=other_sources,
    script:
        "../scripts/step.py"
