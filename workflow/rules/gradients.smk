# Encoders and embeddings -> what GP-CA's scores react to: saliency of points, TCAV -> gradients.csv.
GRADIENT_ENCODER = config["embedding"]["encoder"]


rule gradients:
    input:
        collect(
            "<results>/saliency/{source}/seed{seed}.csv",
            source=NAMES["gradient_source"],
            seed=SEEDS,
        ),


rule follow_gradients:
    input:
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        encoders=collect(
            f"<results>/encoders/{{{{source}}}}/{GRADIENT_ENCODER}/seed{{seed}}.pt",
            seed=SEEDS,
        ),
        embeddings=collect(
            f"<results>/embeddings/{{{{source}}}}/{GRADIENT_ENCODER}/none/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        code=code_files(
            "gpca.experiments.gradients.step", encoder_module(GRADIENT_ENCODER)
        ),
    output:
        deletions=collect("<results>/saliency/{{source}}/seed{seed}.csv", seed=SEEDS),
        maps=collect("<results>/saliency/{{source}}/seed{seed}.npz", seed=SEEDS),
        tcav=collect("<results>/tcav/{{source}}/seed{seed}.csv", seed=SEEDS),
    log:
        "<logs>/saliency/{source}.log",
    benchmark:
        "<benchmarks>/saliency/{source}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.gradients.step",
        settings=as_json(
            {
                "gradients": config["gradients"],
                "encoder": config["encoders"][GRADIENT_ENCODER],
                "gpc": config["explainers"].get("gpca") or {},
            }
        ),
        seeds=SEEDS,
    script:
        "../scripts/step.py"
