# Files of a run -> the printed numbers under every reading of what the paper leaves unstated.
from gpca.experiments.specification_curve.registry import FRAME_INPUT, GROUPS

READINGS = config["readings"]
READING_SIZES = {name: READINGS[name] for name in ("seeds", "encoders", "samples")}
BACKBONE = REAL_WORLD["backbones"][0]  # whose encoder of frames sees other clouds
ENCODERS_OF_READINGS = {
    "encoder_head": config["embedding"]["encoder"],
    FRAME_INPUT: BACKBONE,
}
READING_SECTIONS = {
    "uncertainty": config["uncertainty"].get("additive", {}),
    "icp": config["registrations"]["icp"],
    "encoder": config["encoders"][config["embedding"]["encoder"]],
    "active_learning": config["active_learning"],
    **{name: config["explainers"].get(name) or {} for name in ("gpca_paper", "gpca")},
}


def read_by_readings(wildcards):
    """Return what a group of readings reads, by kind of file; those on depth frames see all seeds."""
    group = GROUPS[wildcards.reading_group]
    if wildcards.reading_group == FRAME_INPUT:
        return read_by_frame_input()
    sources = [name for name in group.sources if name in SOURCES]
    seeds = SEEDS[: 1 if group.costly else READINGS["seeds"]]
    made = "predictions"
    methods = [name for name in group.methods if name in config["explainers"]]
    if wildcards.reading_group == "diagnostics":
        made = "learners"
        methods = [name for name in group.methods if name in config["learners"]]
    if not group.sources:
        sources, seeds, methods = [FRAMES], SEEDS, NAMES["backbone"]
    patterns = {
        "registrations": "<results>/registrations/{source}/seed{seed}.npz",
        "sets": "<results>/shifted/{source}/seed{seed}.npz",
        "predictions": f"<results>/{made}/{{source}}/{{method}}/seed{{seed}}.csv",
        "embeddings": "<results>/embeddings/{source}/{method}/seed{seed}.npz",
    }
    embedded = [method.replace("-", "/") for method in methods]
    return {
        kind: collect(
            patterns[kind],
            source=sources,
            method=embedded if kind == "embeddings" else methods,
            seed=SEEDS[:1] if kind == "embeddings" else seeds,
        )
        for kind in group.reads
    }


def read_by_frame_input():
    """Return the frames of its seeds with what the protocol's encoder makes of them, and what others start from."""
    of = {"source": FRAMES, "seed": SEEDS[: READINGS["frame_seeds"]]}
    return {
        "registrations": [
            *collect("<results>/registrations/{source}/seed{seed}.npz", **of),
            *(PRETRAINED_ON if REAL_WORLD["pretraining"] else []),
        ],
        "poses": collect("<results>/poses/{source}/seed{seed}.csv", **of),
        "predictions": collect(
            f"<results>/predictions/{{source}}/{BACKBONE}-none/seed{{seed}}.csv", **of
        ),
    }


def reading_sections(group):
    """Return the sections of the config that a group reads beside its choices."""
    if group != FRAME_INPUT:
        return READING_SECTIONS
    training = (REAL_WORLD["training"] or {}).get(BACKBONE) or {}
    of_frames = {"pretraining": REAL_WORLD["pretraining"] or {}, "training": training}
    encoder = {"encoder": config["encoders"][BACKBONE]}
    return (
        {name: READING_SECTIONS[name] for name in ("icp", "gpca")} | of_frames | encoder
    )


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
        reading_group="|".join(GROUPS),
    priority: 12  # that of the frames' clouds trains encoders: the longest job, with many cores to be started early
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
                **reading_sections(wildcards.reading_group),
            }
        ),
    script:
        "../scripts/step.py"
