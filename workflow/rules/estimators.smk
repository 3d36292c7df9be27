# Registrations with measured causes -> what every estimator says of their uncertainty -> estimators.csv.
from gpca.experiments.estimators.experiment import estimates_of
from gpca.process.plugins import is_outside
from gpca.uncertainty.estimators.registry import estimator_module

# Those from outside have jobs of their own.
OUTSIDE_ESTIMATORS = [
    name for name in NAMES["estimator"] if is_outside(estimator_module(name))
]
OUTSIDE_ESTIMATES = {
    estimate: name
    for name in OUTSIDE_ESTIMATORS
    for estimate in estimates_of(name, config, SOURCES)
}
ESTIMATORS = [name for name in NAMES["estimator"] if name not in OUTSIDE_ESTIMATORS]
ESTIMATES = [name for name in NAMES["estimate"] if name not in OUTSIDE_ESTIMATES]


rule estimates:
    input:
        collect(
            "<results>/estimates/{source}/{estimator}/seed{seed}.csv",
            source=SOURCES,
            estimator=NAMES["estimate"],
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
            *map(estimator_module, ESTIMATORS),
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
        settings=estimator_settings(ESTIMATORS),
        other=lambda wildcards: "".join(next_source(wildcards)),
        estimators=ESTIMATORS,
        estimates=ESTIMATES,
        seeds=SEEDS,
    script:
        "../scripts/step.py"


use rule estimate as estimate_outside with:
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
        code=lambda wildcards: code_files(
            "gpca.experiments.estimators.step",
            estimator_module(OUTSIDE_ESTIMATES[wildcards.outside_estimate]),
            *map(method_module, config["estimator_pairs"]["methods"]),
        ),
    output:
        rows=collect(
            "<results>/estimates/{{source}}/{{outside_estimate}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/estimator_{{outside_estimate}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "<logs>/estimates/{source}/{outside_estimate}.log",
    benchmark:
        "<benchmarks>/estimates/{source}/{outside_estimate}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
        outside_estimate="|".join(OUTSIDE_ESTIMATES) or "none",
    params:
        settings=lambda wildcards: estimator_settings(
            [OUTSIDE_ESTIMATES[wildcards.outside_estimate]]
        ),
        estimators=lambda wildcards: [OUTSIDE_ESTIMATES[wildcards.outside_estimate]],
        estimates=lambda wildcards: [wildcards.outside_estimate],
