# Registrations -> Monte-Carlo ICP under the conditions of a design, for the explainers that read it.
rule uncertainty:
    input:
        collect(
            "<results>/uncertainty/{source}/{design}/seed{seed}.npz",
            source=SOURCES,
            design=config["uncertainty"],
            seed=SEEDS,
        ),


rule run_icp:
    input:
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=code_stamp("gpca.steps.pairs:uncertainty"),
    output:
        outcomes=collect(
            "<results>/uncertainty/{{source}}/{{design}}/seed{seed}.npz", seed=SEEDS
        ),
        tables=collect(
            "<results>/uncertainty/{{source}}/{{design}}/seed{seed}.csv", seed=SEEDS
        ),
        timings=collect(
            "<results>/timings/{{source}}/uncertainty_{{design}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "<logs>/uncertainty/{source}/{design}.log",
    benchmark:
        "<benchmarks>/uncertainty/{source}/{design}.tsv"
    priority: 3
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:uncertainty",
        settings=lambda wildcards: as_json(
            config["uncertainty"][wildcards.design]
            | {"icp": config["registrations"]["icp"]}
        ),
        seeds=SEEDS,
    script:
        "../scripts/step.py"
