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
    "gpca_matern": LEARNER_SETTINGS.get("gpca_matern", {}),
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
