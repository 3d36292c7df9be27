# Test samples of the causes -> what re-enactments say of them that know parts of the truth.


rule oracles:
    input:
        objects="<results>/objects/{source}.npz",
        causes="<results>/causes/{source}/seed{seed}.npz",
        code=code_files("gpca.experiments.reenactment.step"),
    output:
        predictions=collect(
            "<results>/oracles/{{source}}/{known}/seed{{seed}}.csv",
            known=NAMES["known"],
        ),
    log:
        "<logs>/oracles/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/oracles/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.reenactment.step",
        settings=as_json(
            {"reenactment": DIAGNOSIS["reenactment"], "causes": config["causes"]} | ICP
        ),
    script:
        "../scripts/step.py"
