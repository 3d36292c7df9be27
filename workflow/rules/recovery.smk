rule recover:
    input:
        code=code_files(
            *("gpca.steps.recover", encoder_module(config["embedding"]["encoder"])),
            *(explainer_module(name) for name in RECOVERY_EXPLAINERS),
            *(
                f"gpca.objects.shapes.{FAMILIES[family]}"
                for family in config["real_world"]["scenes"]["families"]
            ),
        ),
    output:
        rows="results/{run}/recovery/seed{seed}.csv",
        policy="results/{run}/recovery/policy_seed{seed}.json",
        example="results/{run}/recovery/example_seed{seed}.npz",
        timings="results/{run}/timings/recovery/seed{seed}.csv",
    log:
        "results/{run}/logs/recovery/seed{seed}.log",
    benchmark:
        "results/{run}/benchmarks/recovery/seed{seed}.tsv"
    priority: 6
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        settings=json.dumps(
            {
                "recovery": RECOVERY,
                "scenes": config["real_world"]["scenes"],
                "registrations": config["registrations"],
                "encoder": config["encoders"][config["embedding"]["encoder"]]
                | RECOVERY["encoder"],
                "uncertainty": config["uncertainty"].get("removal", {}),
                "explainers": {
                    name: config["explainers"].get(name) or {}
                    for name in RECOVERY_EXPLAINERS
                },
            },
            sort_keys=True,
        ),
    shell:
        "python -m gpca recover --threads {threads} --seed {wildcards.seed} --settings {params.settings:q} "
        "--out {output.rows} --timings {output.timings} --policy {output.policy} --example {output.example} 2> {log}"


rule recovery_metrics:
    input:
        recovery=collect("results/{{run}}/recovery/seed{seed}.csv", seed=SEEDS),
        code=code_files("gpca.recovery.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/recovery.csv",
    log:
        "results/{run}/logs/recovery.log",
    benchmark:
        "results/{run}/benchmarks/recovery.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        treatments=RECOVERY["treatments"],
        budget=RECOVERY["loop"]["budget"],
    script:
        "../scripts/collect_recovery.py"


rule table8_recovery:
    input:
        metrics="results/{run}/recovery.csv",
        timings=collect("results/{{run}}/timings/recovery/seed{seed}.csv", seed=SEEDS),
        code=code_files("gpca.reporting.tables.recovery", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/table8_recovery.csv"),
        md="results/{run}/tables/table8_recovery.md",
        tex="results/{run}/tables/table8_recovery.tex",
    log:
        "results/{run}/logs/tables/table8_recovery.log",
    benchmark:
        "results/{run}/benchmarks/tables/table8_recovery.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        policies=POLICIES,
        budget=RECOVERY["loop"]["budget"],
    script:
        "../scripts/recovery_table.py"


rule recovery_figure:
    input:
        data=lambda wildcards: f"results/{wildcards.run}/{RECOVERY_FIGURES[wildcards.figure]}",
        code=code_files(
            *("gpca.reporting.figures.recovery_rates", "gpca.reporting.figures.policy"),
            *("gpca.reporting.figures.recovery_example", "gpca.reporting.script"),
        ),
    output:
        pdf="results/{run}/figures/{figure}.pdf",
        png=reported("results/{run}/figures/{figure}.png"),
    log:
        "results/{run}/logs/figures/{figure}.log",
    benchmark:
        "results/{run}/benchmarks/figures/{figure}.tsv"
    wildcard_constraints:
        figure="|".join(RECOVERY_FIGURES),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        policies=POLICIES,
        budget=RECOVERY["loop"]["budget"],
    script:
        "../scripts/recovery_figure.py"
