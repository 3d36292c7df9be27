# Further registrations with measured causes -> how the diagnosis grows with the number of training samples.
from gpca.experiments.learning_curve.experiment import of_curve

CURVE = {"learning_curve": of_curve(config["learning_curve"])}


rule learning_samples:
    input:
        objects="<results>/objects/{source}.npz",
        code=code_files("gpca.experiments.learning_curve.samples_step"),
    output:
        samples="<results>/learning_samples/{source}/seed{seed}/chunk{chunk}.npz",
    log:
        "<logs>/learning_samples/{source}/seed{seed}/chunk{chunk}.log",
    benchmark:
        "<benchmarks>/learning_samples/{source}/seed{seed}/chunk{chunk}.tsv"
    wildcard_constraints:
        chunk=r"\d+",
    priority: 5
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.learning_curve.samples_step",
        settings=as_json(CURVE | {"causes": config["causes"]} | ICP),
    script:
        "../scripts/step.py"


rule learn_from_more:
    input:
        causes="<results>/causes/{source}/seed{seed}.npz",
        descriptors="<results>/descriptors/{source}/seed{seed}.npz",
        samples=collect(
            "<results>/learning_samples/{{source}}/seed{{seed}}/chunk{chunk}.npz",
            chunk=NAMES["chunk"],
        ),
        code=code_files("gpca.experiments.learning_curve.step"),
    output:
        out="<results>/learning_curve/{source}/seed{seed}.csv",
    log:
        "<logs>/learning_curve/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/learning_curve/{source}/seed{seed}.tsv"
    priority: 4
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.learning_curve.step",
        settings=as_json(CURVE),
    script:
        "../scripts/step.py"
