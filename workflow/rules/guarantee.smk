# Causes and what is measured on them -> scores by models that learned from some families of shapes and not from others.
GUARANTEED = {name: DIAGNOSIS["explainers"][name] for name in NAMES["guaranteed"]}


rule guarantee_scores:
    input:
        causes=collect(
            "<results>/causes/{source}/seed{seed}.npz", source=SOURCES, seed=SEEDS
        ),
        descriptors=collect(
            "<results>/descriptors/{source}/seed{seed}.npz", source=SOURCES, seed=SEEDS
        ),
        reenactments=collect(
            "<results>/reenactments/{source}/seed{seed}.npz",
            source=SOURCES,
            seed=SEEDS,
        ),
        diagnoses=collect(
            "<results>/diagnoses/{source}/{cause_explainer}/seed{seed}.csv",
            source=SOURCES,
            cause_explainer=NAMES["guaranteed"],
            seed=SEEDS,
        ),
        frame_causes=collect(
            "<results>/frame_causes/seed{seed}.npz", seed=NAMES["frame_cause_seed"]
        ),
        frame_samples=collect(
            "<results>/frame_causes/seed{seed}.csv", seed=NAMES["frame_cause_seed"]
        ),
        frame_predictions=collect(
            "<results>/frame_diagnoses/seed{seed}.csv", seed=NAMES["frame_cause_seed"]
        ),
        code=code_files(
            "gpca.experiments.guarantee.step",
            *(explainer_module(name, CAUSES) for name in GUARANTEED),
        ),
    output:
        scores=collect(
            "<results>/guarantee/{guaranteed}.csv", guaranteed=NAMES["guaranteed"]
        ),
    log:
        "<logs>/guarantee.log",
    benchmark:
        "<benchmarks>/guarantee.tsv"
    priority: 3
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.guarantee.step",
        settings=as_json({"explainers": GUARANTEED}),
    script:
        "../scripts/step.py"
