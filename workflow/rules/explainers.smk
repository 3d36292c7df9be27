# Every explainer -> its predictions, one schema for all; the tidy metrics and timings of these.
from gpca.experiments.run import explainer_of, files_behind
from gpca.frames.source import ONE_ENCODER


rule predictions:
    input:
        collect(
            "<results>/predictions/{source}/{explainer}/seed{seed}.csv",
            source=SOURCES,
            explainer=config["explainers"],
            seed=SEEDS,
        ),
        FRAME_PREDICTIONS,


rule attribute:
    input:
        unpack(lambda wildcards: read_by_explainer(wildcards, SEEDS)),
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=SEEDS
        ),
        code=lambda wildcards: code_stamp(
            "gpca.steps.pairs:attribute",
            explainer_module(explainer_of(wildcards.explainer, NAMES)),
        ),
    output:
        predictions=collect(
            "<results>/predictions/{{source}}/{{explainer}}/seed{seed}.csv", seed=SEEDS
        ),
        timings=collect(
            "<results>/timings/{{source}}/{{explainer}}/seed{seed}.csv", seed=SEEDS
        ),
    log:
        "<logs>/predictions/{source}/{explainer}.log",
    benchmark:
        "<benchmarks>/predictions/{source}/{explainer}.tsv"
    wildcard_constraints:
        source="|".join([*SOURCES, *NAMES["condition"]]),
    priority: 11  # as `embed`
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.pairs:attribute",
        explainer=lambda wildcards: explainer_of(wildcards.explainer, NAMES),
        settings=lambda wildcards: as_json(explainer_settings(wildcards)),
        seeds=SEEDS,
    script:
        "../scripts/step.py"


# Depth frames have seeds of their own, and on them encoders as published fewer.
use rule attribute as attribute_on_frames with:
    input:
        unpack(lambda wildcards: read_by_explainer(wildcards, FRAME_SEEDS)),
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz", seed=FRAME_SEEDS
        ),
        code=lambda wildcards: code_stamp(
            "gpca.steps.pairs:attribute",
            explainer_module(explainer_of(wildcards.explainer, NAMES)),
        ),
    output:
        predictions=collect(
            "<results>/predictions/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=FRAME_SEEDS,
        ),
        timings=collect(
            "<results>/timings/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=FRAME_SEEDS,
        ),
    wildcard_constraints:
        source=FRAMES,
        explainer=but_published(EXPLAINED),
    params:
        seeds=FRAME_SEEDS,


use rule attribute as attribute_published with:
    input:
        unpack(lambda wildcards: read_by_explainer(wildcards, NAMES["published_seed"])),
        registrations=collect(
            "<results>/registrations/{{source}}/seed{seed}.npz",
            seed=NAMES["published_seed"],
        ),
        code=code_stamp("gpca.steps.pairs:attribute", explainer_module("gpca")),
    output:
        predictions=collect(
            "<results>/predictions/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=NAMES["published_seed"],
        ),
        timings=collect(
            "<results>/timings/{{source}}/{{explainer}}/seed{seed}.csv",
            seed=NAMES["published_seed"],
        ),
    wildcard_constraints:
        source=FRAMES,
        explainer="|".join(NAMES["published"]) or "none",
    params:
        seeds=NAMES["published_seed"],


# Classifiers of several seeds on what the first seed's encoder makes of the first seed's frames.
use rule attribute as attribute_one_encoder with:
    input:
        unpack(
            lambda wildcards: {
                option: [
                    f"<results>/{pattern.format(source=FRAMES, seed=SEEDS[0])}"
                    for _ in SEEDS
                ]
                for option, pattern in files_behind(wildcards.explainer, NAMES).items()
            }
        ),
        registrations=[
            f"<results>/registrations/{FRAMES}/seed{SEEDS[0]}.npz" for _ in SEEDS
        ],
        code=code_stamp("gpca.steps.pairs:attribute", explainer_module("gpca")),
    wildcard_constraints:
        source=ONE_ENCODER,
        explainer=but_published(EXPLAINED),
    params:
        files_of=FRAMES,
        files_seed=SEEDS[0],
