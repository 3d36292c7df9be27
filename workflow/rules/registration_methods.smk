# The test pairs of the registrations by every registration method -> registration_methods.csv.
from gpca.alignment.methods.registry import left_out

METHODS = NAMES["method"]
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
            method=METHODS,
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
