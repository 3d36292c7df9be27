# Registrations with measured causes -> what explainers say of them.


rule diagnoses:
    input:
        collect(
            "<results>/diagnoses/{source}/{cause_explainer}/seed{seed}.csv",
            source=SOURCES,
            cause_explainer=DIAGNOSIS["explainers"],
            seed=SEEDS,
        ),


rule diagnose:
    input:
        causes=collect("<results>/causes/{{source}}/seed{seed}.npz", seed=SEEDS),
        read=lambda wildcards: collect(
            f"<results>/{read_by(wildcards.cause_explainer)}/{wildcards.source}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        read_timings=lambda wildcards: collect(
            f"<results>/timings/{wildcards.source}/{read_by(wildcards.cause_explainer)}/seed{{seed}}.csv",
            seed=SEEDS,
        ),
        code=lambda wildcards: code_files(
            "gpca.steps.diagnosis:diagnose",
            explainer_module(wildcards.cause_explainer, CAUSES),
        ),
    output:
        predictions=collect(
            "<results>/diagnoses/{{source}}/{{cause_explainer}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/diagnoses_{{cause_explainer}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "<logs>/diagnoses/{source}/{cause_explainer}.log",
    benchmark:
        "<benchmarks>/diagnoses/{source}/{cause_explainer}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.diagnosis:diagnose",
        explainer=lambda wildcards: wildcards.cause_explainer,
        remedies=as_json(DIAGNOSIS["descriptors"]),
        reenactment=as_json(DIAGNOSIS["reenactment"]),
        settings=lambda wildcards: as_json(
            DIAGNOSIS["explainers"][wildcards.cause_explainer] or {}
        ),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


# Learners that see more and more parts of a pair, all of a source in one job.
rule diagnose_by_features:
    input:
        causes=collect("<results>/causes/{{source}}/seed{seed}.npz", seed=SEEDS),
        descriptors=collect(
            "<results>/descriptors/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=code_files(
            "gpca.steps.diagnosis:diagnose_by_features",
            *(explainer_module(name, CAUSES) for name in DIAGNOSIS["by_features"]),
        ),
    output:
        predictions=collect(
            "<results>/feature_diagnoses/{{source}}/{feature_explainer}/seed{seed}.csv",
            feature_explainer=DIAGNOSIS["by_features"],
            seed=SEEDS,
        ),
    log:
        "<logs>/feature_diagnoses/{source}.log",
    benchmark:
        "<benchmarks>/feature_diagnoses/{source}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.diagnosis:diagnose_by_features",
        settings=as_json(
            {name: DIAGNOSIS[name] for name in ("by_features", "descriptors")}
        ),
        seeds=SEEDS,
    script:
        "../scripts/step.py"
