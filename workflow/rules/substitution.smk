# Registrations -> what explainers say with other methods, and other estimators of uncertainty, beneath them.
EXCHANGE = config["exchange"]
EXCHANGE_METHODS = NAMES["exchange_method"]
EXCHANGE_SEEDS = NAMES["exchange_seed"]
EXCHANGE_EXPLAINERS = {
    name: (config["explainers"].get(name) or {}) | (own or {})
    for name, own in EXCHANGE["explainers"].items()
}


rule exchanges:
    input:
        collect(
            "<results>/exchange/{source}/seed{seed}.csv",
            source=EXCHANGE["sources"],
            seed=EXCHANGE_SEEDS,
        ),


rule explain_exchanged:
    input:
        objects="<results>/objects/{source}.npz",
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=EXCHANGE_SEEDS
        ),
        encoders=collect(
            f"<results>/encoders/{{{{source}}}}/{CONTROL_ENCODER}/seed{{seed}}.pt",
            seed=EXCHANGE_SEEDS,
        ),
        code=code_files(
            "gpca.experiments.substitution.step",
            encoder_module(CONTROL_ENCODER),
            *map(explainer_module, EXCHANGE_EXPLAINERS),
            *map(method_module, EXCHANGE_METHODS),
            *map(estimator_module, EXCHANGE["estimators"]),
        ),
    output:
        out=collect("<results>/exchange/{{source}}/seed{seed}.csv", seed=EXCHANGE_SEEDS),
    log:
        "<logs>/exchange/{source}.log",
    benchmark:
        "<benchmarks>/exchange/{source}.tsv"
    wildcard_constraints:
        source="|".join(EXCHANGE["sources"]),
    priority: 2
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.substitution.step",
        settings=as_json(
            {
                "exchange": {
                    name: value
                    for name, value in EXCHANGE.items()
                    if name not in ("sources", "explainers")
                }
                | {"methods": EXCHANGE_METHODS},
                "explainers": EXCHANGE_EXPLAINERS,
                "methods": {
                    name: config["methods"][name] for name in EXCHANGE_METHODS
                },
                "estimators": {
                    name: config["estimators"][name] for name in EXCHANGE["estimators"]
                },
                "uncertainty": config["uncertainty"].get("additive", {}),
                "encoder": config["encoders"][CONTROL_ENCODER],
            }
        ),
        seeds=EXCHANGE_SEEDS,
    script:
        "../scripts/step.py"
