# Registrations with measured causes -> what every estimator says of their uncertainty -> estimators.csv.
from gpca.uncertainty.estimators.registry import estimator_module

ESTIMATES = NAMES["estimate"]


rule estimates:
    input:
        collect(
            "<results>/estimates/{source}/{estimator}/seed{seed}.csv",
            source=SOURCES,
            estimator=ESTIMATES,
            seed=SEEDS,
        ),


rule estimate:
    input:
        objects="<results>/objects/{source}.npz",
        causes=collect("<results>/causes/{{source}}/seed{seed}.npz", seed=SEEDS),
        other_objects=lambda wildcards: collect(
            "<results>/objects/{source}.npz", source=next_source(wildcards)
        ),
        other_causes=lambda wildcards: collect(
            "<results>/causes/{source}/seed{seed}.npz",
            source=next_source(wildcards),
            seed=SEEDS,
        ),
        code=code_files(
            "gpca.experiments.estimators.step",
            *map(estimator_module, NAMES["estimator"]),
            *map(method_module, config["estimator_pairs"]["methods"]),
        ),
    output:
        rows=collect(
            "<results>/estimates/{{source}}/{estimator}/seed{seed}.csv",
            estimator=ESTIMATES,
            seed=SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/estimator_{estimator}/seed{seed}.csv",
            estimator=ESTIMATES,
            seed=SEEDS,
        ),
        samples=collect(
            "<results>/reference_samples/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
    log:
        "<logs>/estimates/{source}.log",
    benchmark:
        "<benchmarks>/estimates/{source}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    priority: 2
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.estimators.step",
        settings=as_json(
            {
                name: config[name]
                for name in ("estimator_pairs", "estimators", "causes", "success")
            }
            | ICP
        ),
        other=lambda wildcards: "".join(next_source(wildcards)),
        estimators=NAMES["estimator"],
        seeds=SEEDS,
    script:
        "../scripts/step.py"
