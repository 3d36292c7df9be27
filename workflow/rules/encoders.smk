# Registrations -> encoders -> embeddings, and their reductions.


rule encoders:
    input:
        collect(
            "<results>/encoders/{source}/{encoder}/seed{seed}.pt",
            source=SOURCES,
            encoder=config["embedding"]["encoder"],
            seed=SEEDS,
        ),
        collect(
            f"<results>/encoders/{FRAMES}/{{encoder}}/seed{{seed}}.pt",
            encoder=config["real_world"]["backbones"],
            seed=FRAME_SEEDS,
        ),


rule embeddings:
    input:
        collect(
            f"<results>/embeddings/{{source}}/{EMBEDDING}/seed{{seed}}.npz",
            source=SOURCES,
            seed=SEEDS,
        ),
        collect(
            f"<results>/embeddings/{FRAMES}/{{backbone}}/{{reduction}}/seed{{seed}}.npz",
            backbone=config["real_world"]["backbones"],
            reduction=config["real_world"]["reductions"],
            seed=FRAME_SEEDS,
        ),


rule train_encoder:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        code=encoder_code("train"),
    output:
        weights="<results>/encoders/{source}/{backbone}/seed{seed}.pt",
        curve="<results>/encoders/{source}/{backbone}/seed{seed}.csv",
    log:
        "<logs>/encoders/{source}/{backbone}/seed{seed}.log",
    benchmark:
        "<benchmarks>/encoders/{source}/{backbone}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join(SOURCES),
    # The longest jobs go first, so that none of them is left over while the other cores wait.
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:train",
        settings=encoder_settings,
    script:
        "../scripts/step.py"


rule pretrain_encoder:
    input:
        registrations=collect(
            "<results>/registrations/{source}/seed{seed}.npz",
            source=PRETRAINED_ON,
            seed=SEEDS[0],
        ),
        code=encoder_code("train"),
    output:
        weights="<results>/encoders/pretrained/{backbone}.pt",
        curve="<results>/encoders/pretrained/{backbone}.csv",
    log:
        "<logs>/encoders/pretrained/{backbone}.log",
    benchmark:
        "<benchmarks>/encoders/pretrained/{backbone}.tsv"
    priority: 11
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=180,
    params:
        step="gpca.steps.pairs:train",
        source="pretraining",
        settings=lambda wildcards: encoder_settings(
            wildcards, pretraining_of(REAL_WORLD, wildcards.backbone)
        ),
        seed=SEEDS[0],
        registrations_of=PRETRAINED_ON,
    script:
        "../scripts/step.py"


rule train_on_frames:
    input:
        unpack(
            lambda wildcards: (
                {"start": "<results>/encoders/pretrained/{backbone}.pt"}
                if REAL_WORLD["pretraining"]
                else {}
            )
        ),
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        poses=f"<results>/poses/{FRAMES}/seed{{seed}}.csv",
        code=encoder_code("train"),
    output:
        weights=f"<results>/encoders/{FRAMES}/{{backbone}}/seed{{seed}}.pt",
        curve=f"<results>/encoders/{FRAMES}/{{backbone}}/seed{{seed}}.csv",
    log:
        f"<logs>/encoders/{FRAMES}/{{backbone}}/seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/encoders/{FRAMES}/{{backbone}}/seed{{seed}}.tsv"
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:train",
        settings=lambda wildcards: encoder_settings(
            wildcards, (REAL_WORLD["training"] or {}).get(wildcards.backbone)
        ),
        source=FRAMES,
    script:
        "../scripts/step.py"


rule embed:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        registration_timings="<results>/timings/{source}/icp/seed{seed}.csv",
        encoder="<results>/encoders/{source}/{backbone}/seed{seed}.pt",
        code=encoder_code("embed"),
    output:
        embeddings="<results>/embeddings/{source}/{backbone}/none/seed{seed}.npz",
        timings="<results>/timings/{source}/{backbone}/seed{seed}.csv",
    log:
        "<logs>/embeddings/{source}/{backbone}/seed{seed}.log",
    benchmark:
        "<benchmarks>/embeddings/{source}/{backbone}/seed{seed}.tsv"
    priority: 11  # the longest reading waits for those of the frames
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:embed",
        settings=encoder_settings,
        encoder_of=lambda wildcards: (
            FRAMES if wildcards.source in NAMES["condition"] else wildcards.source
        ),
    script:
        "../scripts/step.py"


# Under other initial poses the encoder is that of the frames, and the classifier learns anew.
use rule embed as embed_condition with:
    input:
        registrations="<results>/registrations/{source}/seed{seed}.npz",
        registration_timings="<results>/timings/{source}/icp/seed{seed}.csv",
        encoder=f"<results>/encoders/{FRAMES}/{{backbone}}/seed{{seed}}.pt",
        code=encoder_code("embed"),
    wildcard_constraints:
        source="|".join(NAMES["condition"]) or "none",


rule reduce_embeddings:
    input:
        embeddings=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/none/seed{seed}.npz",
            seed=SEEDS,
        ),
        code=code_stamp("gpca.steps.pairs:reduce"),
    output:
        out=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/{{reduction}}/seed{seed}.npz",
            seed=SEEDS,
        ),
    log:
        "<logs>/embeddings/{source}/{backbone}/{reduction}.log",
    benchmark:
        "<benchmarks>/embeddings/{source}/{backbone}/{reduction}.tsv"
    wildcard_constraints:
        source="|".join([*SOURCES, *NAMES["condition"]]),
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:reduce",
        settings=settings("reductions", "{reduction}"),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


# Depth frames have seeds of their own, and on them encoders as published fewer.
use rule reduce_embeddings as reduce_on_frames with:
    input:
        embeddings=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/none/seed{seed}.npz",
            seed=FRAME_SEEDS,
        ),
        code=code_stamp("gpca.steps.pairs:reduce"),
    output:
        out=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/{{reduction}}/seed{seed}.npz",
            seed=FRAME_SEEDS,
        ),
    wildcard_constraints:
        source=FRAMES,
        backbone=but_published(config["encoders"]),
    params:
        seeds=FRAME_SEEDS,


use rule reduce_embeddings as reduce_published with:
    input:
        embeddings=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/none/seed{seed}.npz",
            seed=NAMES["published_seed"],
        ),
        code=code_stamp("gpca.steps.pairs:reduce"),
    output:
        out=collect(
            "<results>/embeddings/{{source}}/{{backbone}}/{{reduction}}/seed{seed}.npz",
            seed=NAMES["published_seed"],
        ),
    wildcard_constraints:
        source=FRAMES,
        backbone="|".join(REAL_WORLD["published"].values()) or "none",
    params:
        seeds=NAMES["published_seed"],
