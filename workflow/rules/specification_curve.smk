# Files of a run -> the printed numbers under every reading of what the paper leaves unstated.
from gpca.experiments.out_of_distribution import learner_settings
from gpca.experiments.specification_curve.registry import (
    FRAME_ENCODER,
    FRAME_INPUT,
    FRAME_REPEATS,
    FRAME_START,
    GROUPS,
    SEVERITIES_RETRAINED,
)
from gpca.experiments.specification_curve.settings import ALIGNED

READINGS = config["readings"]
READING_SIZES = {name: READINGS[name] for name in ("seeds", "encoders", "samples")}
RETRAINED_SEEDS = SEEDS[: READINGS["encoders"]]
BACKBONE = REAL_WORLD["backbones"][0]  # whose encoder of frames sees other clouds
OTHER_CLOUDS = [
    cloud
    for cloud in READINGS["groups"].get(FRAME_INPUT, {}).get("input", [])
    if cloud != ALIGNED
]
ENCODERS_OF_READINGS = {"encoder_head": config["embedding"]["encoder"]}
READING_SECTIONS = {
    "uncertainty": config["uncertainty"].get("additive", {}),
    "icp": config["registrations"]["icp"],
    "encoder": config["encoders"][config["embedding"]["encoder"]],
    "active_learning": LEARNING_SETTINGS,
    **{name: config["explainers"].get(name) or {} for name in ("gpca_paper", "gpca")},
    "gpca_matern": learner_settings(config).get("gpca_matern", {}),
}
FRAME_ROWS = {
    "frames": {
        "source": FRAMES,
        "methods": NAMES["backbone"],
        "estimated": NAMES["estimated"],
    },
    "published": REAL_WORLD["published"],
}


rule reading:
    input:
        unpack(read_by_readings),
        code=lambda wildcards: code_files(
            "gpca.experiments.specification_curve.step",
            GROUPS[wildcards.reading_group].module,
            *map(explainer_module, GROUPS[wildcards.reading_group].explainers),
            *(
                [encoder_module(encoder)]
                if (encoder := ENCODERS_OF_READINGS.get(wildcards.reading_group))
                else []
            ),
        ),
    output:
        out="<results>/readings/{reading_group}.csv",
    log:
        "<logs>/readings/{reading_group}.log",
    benchmark:
        "<benchmarks>/readings/{reading_group}.tsv"
    wildcard_constraints:
        reading_group="|".join(name for name in GROUPS if name != FRAME_REPEATS),
    priority: 9
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=4000,
        runtime=120,
    params:
        step="gpca.experiments.specification_curve.step",
        group=lambda wildcards: wildcards.reading_group,
        settings=lambda wildcards: as_json(
            {
                "choices": READINGS["groups"][wildcards.reading_group],
                "sizes": READING_SIZES,
                **(
                    FRAME_ROWS
                    if wildcards.reading_group in (FRAME_ENCODER, FRAME_START)
                    else READING_SECTIONS
                ),
            }
        ),
    script:
        "../scripts/step.py"


# Repeats on depth frames fit a classifier for each row and seed: each kind of repeat and backbone has a job.
use rule reading as repeat_on_frames with:
    input:
        unpack(read_by_repeats),
        code=code_files(
            "gpca.experiments.specification_curve.step",
            GROUPS[FRAME_REPEATS].module,
        ),
    output:
        out=f"<results>/readings/{FRAME_REPEATS}/{{repeats}}/{{backbone}}.csv",
    log:
        f"<logs>/readings/{FRAME_REPEATS}/{{repeats}}/{{backbone}}.log",
    benchmark:
        f"<benchmarks>/readings/{FRAME_REPEATS}/{{repeats}}/{{backbone}}.tsv"
    wildcard_constraints:
        repeats=r"\w+",
    params:
        group=FRAME_REPEATS,
        settings=lambda wildcards: as_json(
            {
                "choices": READINGS["groups"][FRAME_REPEATS]
                | {"repeats": [wildcards.repeats]},
                "sizes": READING_SIZES,
                **READING_SECTIONS,
            }
        ),


rule join_repeats:
    input:
        paths=collect(
            f"<results>/readings/{FRAME_REPEATS}/{{repeats}}/{{backbone}}.csv",
            repeats=READINGS["groups"].get(FRAME_REPEATS, {}).get("repeats", []),
            backbone=REAL_WORLD["backbones"],
        ),
        code=collector_code("gpca.evaluation.measures:read_all_metrics"),
    output:
        f"<results>/readings/{FRAME_REPEATS}.csv",
    log:
        f"<logs>/readings/{FRAME_REPEATS}.log",
    benchmark:
        f"<benchmarks>/readings/{FRAME_REPEATS}.tsv"
    localrule: True
    conda:
        "../envs/gpca.yaml"
    params:
        collector="gpca.evaluation.measures:read_all_metrics",
    script:
        "../scripts/collect.py"


# Other severities, in training too.
rule retrain:
    input:
        objects="<results>/objects/{source}.npz",
        code=code_files(
            "gpca.experiments.specification_curve.retrain_step",
            encoder_module(config["embedding"]["encoder"]),
        ),
    output:
        out="<results>/retrained/{severities}/{source}/seed{seed}.npz",
    log:
        "<logs>/retrained/{severities}/{source}/seed{seed}.log",
    benchmark:
        "<benchmarks>/retrained/{severities}/{source}/seed{seed}.tsv"
    wildcard_constraints:
        source="|".join([*SOURCES, *NAMES["development_source"]]),
        severities=r"\w+",
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.specification_curve.retrain_step",
        settings=lambda wildcards: as_json(
            {
                "shift": config["shift"],
                "registrations": retrained_on(wildcards.severities),
                "encoder": config["encoders"][config["embedding"]["encoder"]],
            }
        ),
    script:
        "../scripts/step.py"


# Encoders of depth frames that see other clouds, one job each: trained as that of the protocol is.
rule pretrain_on_other_cloud:
    input:
        registrations=collect(
            "<results>/registrations/{source}/seed{seed}.npz",
            source=PRETRAINED_ON,
            seed=SEEDS[0],
        ),
        code=code_files("gpca.steps.pairs:train", encoder_module(BACKBONE)),
    output:
        weights=f"<results>/other_clouds/pretrained/{BACKBONE}/{{cloud}}.pt",
        curve=f"<results>/other_clouds/pretrained/{BACKBONE}/{{cloud}}.csv",
    log:
        f"<logs>/other_clouds/pretrained/{BACKBONE}/{{cloud}}.log",
    benchmark:
        f"<benchmarks>/other_clouds/pretrained/{BACKBONE}/{{cloud}}.tsv"
    wildcard_constraints:
        cloud="|".join(OTHER_CLOUDS) or "none",
    priority: 12  # the longest jobs, with many cores to be started early
    conda:
        "../envs/gpca.yaml"
    resources:
        mem_mb=3000,
        runtime=180,
    params:
        step="gpca.steps.pairs:train",
        source="pretraining",
        settings=lambda wildcards: other_cloud_settings(
            wildcards, REAL_WORLD["pretraining"]
        ),
        seed=SEEDS[0],
        registrations_of=PRETRAINED_ON,
    script:
        "../scripts/step.py"


rule train_on_other_cloud:
    input:
        unpack(
            lambda wildcards: (
                {"start": f"<results>/other_clouds/pretrained/{BACKBONE}/{{cloud}}.pt"}
                if REAL_WORLD["pretraining"]
                else {}
            )
        ),
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        poses=f"<results>/poses/{FRAMES}/seed{{seed}}.csv",
        code=code_files("gpca.steps.pairs:train", encoder_module(BACKBONE)),
    output:
        weights=f"<results>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.pt",
        curve=f"<results>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.csv",
    log:
        f"<logs>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.tsv"
    wildcard_constraints:
        cloud="|".join(OTHER_CLOUDS) or "none",
    priority: 11
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:train",
        settings=lambda wildcards: other_cloud_settings(
            wildcards, (REAL_WORLD["training"] or {}).get(BACKBONE)
        ),
        source=FRAMES,
    script:
        "../scripts/step.py"


rule embed_other_cloud:
    input:
        registrations=f"<results>/registrations/{FRAMES}/seed{{seed}}.npz",
        registration_timings=f"<results>/timings/{FRAMES}/icp/seed{{seed}}.csv",
        encoder=f"<results>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.pt",
        code=code_files("gpca.steps.pairs:embed", encoder_module(BACKBONE)),
    output:
        embeddings=f"<results>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/seed{{seed}}.npz",
        timings=f"<results>/timings/{FRAMES}/{BACKBONE}_{{cloud}}/seed{{seed}}.csv",
    log:
        f"<logs>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/embed_seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/other_clouds/{FRAMES}/{BACKBONE}/{{cloud}}/embed_seed{{seed}}.tsv"
    wildcard_constraints:
        cloud="|".join(OTHER_CLOUDS) or "none",
    priority: 11
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:embed",
        settings=lambda wildcards: other_cloud_settings(
            wildcards, (REAL_WORLD["training"] or {}).get(BACKBONE)
        ),
        source=FRAMES,
    script:
        "../scripts/step.py"
