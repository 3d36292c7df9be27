rule scenes:
    input:
        code=code_files(
            "gpca.steps.scenes",
            *(
                f"gpca.objects.shapes.{FAMILIES[family]}"
                for family in config["real_world"]["scenes"]["families"]
            ),
        ),
    output:
        directory(f"results/{{run}}/scenes/{REAL_WORLD}"),
    log:
        "results/{run}/logs/scenes.log",
    benchmark:
        "results/{run}/benchmarks/scenes.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=settings("real_world", "scenes"),
        source=REAL_WORLD,
    shell:
        "python -m gpca scenes --threads {threads} --source {params.source} "
        "--settings {params.settings:q} --out {output} 2> {log}"


rule instances:
    input:
        unpack(frames_inputs),
        code=code_files("gpca.steps.instances"),
    output:
        instances=f"results/{{run}}/instances/{REAL_WORLD}.npz",
        objects=f"results/{{run}}/objects/{REAL_WORLD}.npz",
    log:
        "results/{run}/logs/instances.log",
    benchmark:
        "results/{run}/benchmarks/instances.tsv"
    priority: 12
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=json.dumps(
            {
                name: config["real_world"][name]
                for name in ("datasets", "initial_pose", "gap")
            },
            sort_keys=True,
        ),
        source=REAL_WORLD,
        frames=frames_option,
        surface_points=config["objects"]["surface_points"],
    shell:
        "python -m gpca instances --threads {threads} --source {params.source} --settings {params.settings:q} "
        "{params.frames} --surface-points {params.surface_points} --out {output.instances} --objects {output.objects} 2> {log}"


rule frame_registrations:
    input:
        instances=f"results/{{run}}/instances/{REAL_WORLD}.npz",
        objects=f"results/{{run}}/objects/{REAL_WORLD}.npz",
        code=code_files("gpca.steps.frame_registrations"),
    output:
        registrations=f"results/{{run}}/registrations/{REAL_WORLD}/seed{{seed}}.npz",
        poses=f"results/{{run}}/poses/{REAL_WORLD}/seed{{seed}}.csv",
        timings=f"results/{{run}}/timings/{REAL_WORLD}/icp/seed{{seed}}.csv",
    log:
        f"results/{{run}}/logs/registrations/{REAL_WORLD}/seed{{seed}}.log",
    benchmark:
        f"results/{{run}}/benchmarks/registrations/{REAL_WORLD}/seed{{seed}}.tsv"
    priority: 11
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        settings=json.dumps(
            config["registrations"]
            | {
                name: config["real_world"][name]
                for name in ("train", "test", "test_share", "occluders")
            },
            sort_keys=True,
        ),
        source=REAL_WORLD,
    shell:
        "python -m gpca frame_registrations --threads {threads} --instances {input.instances} "
        "--objects {input.objects} --source {params.source} --seed {wildcards.seed} --settings {params.settings:q} "
        "--out {output.registrations} --poses {output.poses} --timings {output.timings} 2> {log}"


rule reduced_embeddings:
    input:
        embeddings=collect(
            "results/{{run}}/embeddings/{{source}}/{{backbone}}/none/seed{seed}.npz",
            seed=SEEDS,
        ),
        code=code_files("gpca.steps.reduce"),
    output:
        collect(
            "results/{{run}}/embeddings/{{source}}/{{backbone}}/{{reduction}}/seed{seed}.npz",
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/embeddings/{source}/{backbone}/{reduction}.log",
    benchmark:
        "results/{run}/benchmarks/embeddings/{source}/{backbone}/{reduction}.tsv"
    wildcard_constraints:
        reduction="|".join(REDUCTIONS),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        settings=settings("reductions", "{reduction}"),
        seeds=SEEDS,
    shell:
        "python -m gpca reduce --threads {threads} --reduction {wildcards.reduction} --source {wildcards.source} "
        "--seeds {params.seeds} --settings {params.settings:q} --embeddings {input.embeddings} --out {output} 2> {log}"


rule explain_with_backbone:
    input:
        registrations=collect(
            "results/{{run}}/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        embeddings=collect(
            "results/{{run}}/embeddings/{{source}}/{{backbone}}/{{reduction}}/seed{seed}.npz",
            seed=SEEDS,
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/{{backbone}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        code=code_files("gpca.steps.attribute", "gpca.explainers.gpca"),
    output:
        predictions=collect(
            "results/{{run}}/predictions/{{source}}/{{backbone}}-{{reduction}}/seed{seed}.csv",
            seed=SEEDS,
        ),
        timings=collect(
            "results/{{run}}/timings/{{source}}/{{backbone}}-{{reduction}}/seed{seed}.csv",
            seed=SEEDS,
        ),
    log:
        "results/{run}/logs/predictions/{source}/{backbone}-{reduction}.log",
    benchmark:
        "results/{run}/benchmarks/predictions/{source}/{backbone}-{reduction}.tsv"
    wildcard_constraints:
        reduction="|".join(["none", *REDUCTIONS]),
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        settings=json.dumps(config["explainers"].get("gpca") or {}, sort_keys=True),
        seeds=SEEDS,
    shell:
        "python -m gpca attribute --threads {threads} --explainer gpca "
        "--source {wildcards.source} --seeds {params.seeds} --settings {params.settings:q} "
        "--registrations {input.registrations} --embeddings {input.embeddings} --input-timings {input.timings} "
        "--predictions {output.predictions} --timings {output.timings} 2> {log}"


rule real_world_metrics:
    input:
        predictions=real_world_predictions([*BACKBONES, *CLASSIC]),
        code=code_files("gpca.attribution.metrics", "gpca.reporting.script"),
    output:
        "results/{run}/real_world.csv",
    log:
        "results/{run}/logs/real_world.log",
    benchmark:
        "results/{run}/benchmarks/real_world.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collect_metrics.py"


rule table6_backbones:
    input:
        metrics="results/{run}/real_world.csv",
        code=code_files("gpca.reporting.tables.backbones", "gpca.reporting.script"),
    output:
        csv=reported("results/{run}/tables/table6_backbones.csv"),
        md="results/{run}/tables/table6_backbones.md",
        tex="results/{run}/tables/table6_backbones.tex",
    log:
        "results/{run}/logs/tables/table6_backbones.log",
    benchmark:
        "results/{run}/benchmarks/tables/table6_backbones.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=REAL_WORLD_TITLE,
        stand_in=not config["real_world"]["datasets"],
        backbones={
            name: config["encoders"][name]
            for name in config["real_world"]["backbones"]
        },
        reductions=config["real_world"]["reductions"],
    script:
        "../scripts/backbone_table.py"


rule confusion_real_world:
    input:
        metrics="results/{run}/real_world.csv",
        code=code_files("gpca.reporting.figures.real_world_confusions", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/confusion_real_world.pdf",
        png=reported("results/{run}/figures/confusion_real_world.png"),
    log:
        "results/{run}/logs/figures/confusion_real_world.log",
    benchmark:
        "results/{run}/benchmarks/figures/confusion_real_world.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        title=REAL_WORLD_TITLE,
        methods=SHOWN_BACKBONES,
    script:
        "../scripts/real_world_confusions.py"


rule fig5_real_world_example:
    input:
        instances=f"results/{{run}}/instances/{REAL_WORLD}.npz",
        objects=f"results/{{run}}/objects/{REAL_WORLD}.npz",
        registrations=f"results/{{run}}/registrations/{REAL_WORLD}/seed{SEEDS[0]}.npz",
        poses=f"results/{{run}}/poses/{REAL_WORLD}/seed{SEEDS[0]}.csv",
        predictions=f"results/{{run}}/predictions/{REAL_WORLD}/{BACKBONES[0]}/seed{SEEDS[0]}.csv",
        code=code_files("gpca.reporting.figures.real_world_example", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/fig5_real_world_example.pdf",
        png=reported("results/{run}/figures/fig5_real_world_example.png"),
    log:
        "results/{run}/logs/figures/fig5_real_world_example.log",
    benchmark:
        "results/{run}/benchmarks/figures/fig5_real_world_example.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=REAL_WORLD_TITLE,
    script:
        "../scripts/real_world_example.py"


rule real_world_failures:
    input:
        objects=f"results/{{run}}/objects/{REAL_WORLD}.npz",
        registrations=collect(
            f"results/{{{{run}}}}/registrations/{REAL_WORLD}/seed{{seed}}.npz",
            seed=SEEDS,
        ),
        poses=collect(
            f"results/{{{{run}}}}/poses/{REAL_WORLD}/seed{{seed}}.csv", seed=SEEDS
        ),
        predictions=real_world_predictions(BACKBONES[:1]),
        code=code_files("gpca.reporting.figures.real_world_failures", "gpca.reporting.script"),
    output:
        pdf="results/{run}/figures/real_world_failures.pdf",
        png=reported("results/{run}/figures/real_world_failures.png"),
    log:
        "results/{run}/logs/figures/real_world_failures.log",
    benchmark:
        "results/{run}/benchmarks/figures/real_world_failures.tsv"
    conda:
        "../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        title=REAL_WORLD_TITLE,
    script:
        "../scripts/real_world_failures.py"
