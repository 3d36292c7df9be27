# Canonical clouds -> perturbed pairs, aligned by ICP and labelled.
rule registrations:
    input:
        collect(
            "<results>/registrations/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS,
        ),
        collect(f"<results>/registrations/{FRAMES}/seed{{seed}}.npz", seed=FRAME_SEEDS),


rule register:
    input:
        objects="<results>/objects/{source}.npz",
        code=code_stamp("gpca.steps.pairs:registrations"),
    output:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        timings="<results>/timings/{source}/icp/seed{seed}.csv",
    log:
        "<logs>/registrations/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/registrations/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    priority: 15  # more than any training: with many cores, the longest ones would start late
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:registrations",
        settings=settings("registrations"),
    script:
        "../scripts/step.py"
