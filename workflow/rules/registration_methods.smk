# The test pairs of the registrations by every registration method -> registration_methods.csv.
from gpca.alignment.methods.registry import left_out
from gpca.plugins import is_outside

START = config["method_pairs"]["global_start"]
# Those from outside have jobs of their own, but for the global start, which all jobs run.
OUTSIDE_METHODS = [
    name
    for name in NAMES["method"]
    if is_outside(method_module(name)) and name != START
]
METHODS = [name for name in NAMES["method"] if name not in OUTSIDE_METHODS]
for name, package in left_out(config["methods"]).items():
    if workflow.is_main_process:
        print(
            f"gpca: registration method '{name}' is skipped: the package {package} is not installed",
            file=sys.stderr,
        )


rule methods:
    input:
        collect(
            "<results>/methods/{source}/{method}/seed{seed}.csv",
            source=SOURCES,
            method=NAMES["method"],
            seed=SEEDS,
        ),


rule register_methods:
    input:
        objects="<results>/objects/{source}.npz",
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=code_files(
            "gpca.experiments.registration_methods.step", *map(method_module, METHODS)
        ),
    output:
        rows=collect(
            "<results>/methods/{{source}}/{method}/seed{seed}.csv",
            method=METHODS,
            seed=SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/method_{method}/seed{seed}.csv",
            method=METHODS,
            seed=SEEDS,
        ),
    log:
        "<logs>/methods/{source}.log",
    benchmark:
        "<benchmarks>/methods/{source}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    priority: 2
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.registration_methods.step",
        settings=as_json(
            {
                "method_pairs": config["method_pairs"],
                "methods": {name: config["methods"][name] for name in METHODS},
            }
        ),
        methods=METHODS,
        seeds=SEEDS,
    script:
        "../scripts/step.py"


use rule register_methods as register_method_outside with:
    input:
        objects="<results>/objects/{source}.npz",
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=lambda wildcards: code_files(
            "gpca.experiments.registration_methods.step",
            *map(method_module, (START, wildcards.outside_method)),
        ),
    output:
        rows=collect(
            "<results>/methods/{{source}}/{{outside_method}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/method_{{outside_method}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "<logs>/methods/{source}/{outside_method}.log",
    benchmark:
        "<benchmarks>/methods/{source}/{outside_method}.tsv"
    wildcard_constraints:
        outside_method="|".join(OUTSIDE_METHODS) or "none",
    params:
        settings=lambda wildcards: as_json(
            {
                "method_pairs": config["method_pairs"],
                "methods": {
                    name: config["methods"][name]
                    for name in (START, wildcards.outside_method)
                },
            }
        ),
        methods=lambda wildcards: [wildcards.outside_method],
