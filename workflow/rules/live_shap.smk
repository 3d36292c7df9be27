# Registrations and the outcomes of design additive -> SHAP by a live function beside SHAP by their table.
LIVE_SEEDS = NAMES["live_seed"]


rule explain_live:
    input:
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=LIVE_SEEDS
        ),
        outcomes=collect(
            "<results>/uncertainty/{{source}}/additive/seed{seed}.npz", seed=LIVE_SEEDS
        ),
        code=code_files(
            "gpca.experiments.live_shap.step", explainer_module("shap_additive")
        ),
    output:
        out=collect("<results>/live_shap/{{source}}/seed{seed}.csv", seed=LIVE_SEEDS),
    log:
        "<logs>/live_shap/{source}.log",
    benchmark:
        "<benchmarks>/live_shap/{source}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.live_shap.step",
        settings=as_json(
            {
                "live_shap": config["live_shap"],
                "additive": config["uncertainty"].get("additive", {}),
                "icp": config["registrations"]["icp"],
            }
        ),
        seeds=LIVE_SEEDS,
    script:
        "../scripts/step.py"
