# Development objects -> values under every joint reading -> the best one -> what it gives on the run's own samples.
# A config without development seeds has none of these rules.
from gpca.experiments.joint_reading.choices import PROTOCOL
from gpca.objects.source import resolve

JOINT = config["joint_reading"]
JOINT_SIZES = {"sizes": {"samples": JOINT["samples"]}}
JOINT_SECTIONS = {
    "gpca_paper": config["explainers"].get("gpca_paper") or {},
    "active_learning": LEARNING_SETTINGS,
    "labels": {name: JOINT[name] for name in ("batch", "labels")},
    "uncertainty": config["uncertainty"].get("additive", {}),
    "icp": config["registrations"]["icp"],
}
JOINT_CODE = [explainer_module("learner_forest")]


if NAMES["development_seed"]:
    DEVELOPMENT = JOINT["source"]
    DEVELOPMENT_OBJECTS = resolve(JOINT["objects"], config["data_dir"])

    rule sample_development_objects:
        input:
            data=data_files(DEVELOPMENT_OBJECTS),
            splits=split_file("objects"),
            code=code_files("gpca.steps.pairs:objects", *source_modules(DEVELOPMENT_OBJECTS)),
        output:
            out=f"<results>/objects/{DEVELOPMENT}.npz",
        log:
            f"<logs>/objects/{DEVELOPMENT}.log",
        benchmark:
            f"<benchmarks>/objects/{DEVELOPMENT}.tsv"
        priority: 20
        conda:
            "../envs/gpca.yaml"
        params:
            step="gpca.steps.pairs:objects",
            source=DEVELOPMENT,
            settings=as_json(JOINT["objects"]),
            folders=data_folders(
                DEVELOPMENT_OBJECTS, config["data_dir"], config["downloads"]
            ),
            surface_points=config["objects"]["surface_points"],
        script:
            "../scripts/step.py"

    rule measure_joint:
        input:
            objects=f"<results>/objects/{DEVELOPMENT}.npz",
            sets=f"<results>/retrained/{{severities}}/{DEVELOPMENT}/seed{{seed}}.npz",
            code=code_files("gpca.experiments.joint_reading.measure_step", *JOINT_CODE),
        output:
            out="<results>/joint_measures/{severities}/seed{seed}.csv",
        log:
            "<logs>/joint_measures/{severities}/seed{seed}.log",
        benchmark:
            "<benchmarks>/joint_measures/{severities}/seed{seed}.tsv"
        wildcard_constraints:
            severities=r"\w+",
        priority: 9
        conda:
            "../envs/gpca.yaml"
        params:
            step="gpca.experiments.joint_reading.measure_step",
            source=DEVELOPMENT,
            settings=lambda wildcards: as_json(
                {
                    "choices": JOINT["choices"],
                    "registrations": retrained_on(wildcards.severities),
                    **JOINT_SIZES,
                    **JOINT_SECTIONS,
                }
            ),
        script:
            "../scripts/step.py"

    rule choose_joint:
        input:
            measured=collect(
                "<results>/joint_measures/{severities}/seed{seed}.csv",
                severities=NAMES["joint_severities"],
                seed=NAMES["development_seed"],
            ),
            code=code_files("gpca.experiments.joint_reading.choose_step"),
        output:
            choice="<results>/joint_choice/choice.csv",
            best="<results>/joint_choice/best.csv",
            scores="<results>/joint_choice/scores.csv",
        log:
            "<logs>/joint_choice.log",
        benchmark:
            "<benchmarks>/joint_choice.tsv"
        priority: 9
        conda:
            "../envs/gpca.yaml"
        params:
            step="gpca.experiments.joint_reading.choose_step",
            settings=as_json(
                {
                    "choices": JOINT["choices"],
                    "stands_for": JOINT["stands_for"],
                    "deals": JOINT["deals"],
                    "tolerances": config["comparison"]["tolerances"],
                }
            ),
        script:
            "../scripts/step.py"

    rule apply_joint:
        input:
            choice="<results>/joint_choice/choice.csv",
            objects="<results>/objects/{source}.npz",
            sets=collect(
                "<results>/shifted/{{source}}/seed{seed}.npz",
                seed=SEEDS[: config["readings"]["seeds"]],
            ),
            other_sets=collect(
                "<results>/retrained/{severities}/{{source}}/seed{seed}.npz",
                severities=[
                    name for name in NAMES["joint_severities"] if name != PROTOCOL
                ],
                seed=SEEDS[: config["readings"]["encoders"]],
            ),
            code=code_files("gpca.experiments.joint_reading.apply_step", *JOINT_CODE),
        output:
            out="<results>/joint_readings/{source}.csv",
        log:
            "<logs>/joint_readings/{source}.log",
        benchmark:
            "<benchmarks>/joint_readings/{source}.tsv"
        wildcard_constraints:
            source="|".join(SOURCES),
        priority: 9
        conda:
            "../envs/gpca.yaml"
        params:
            step="gpca.experiments.joint_reading.apply_step",
            settings=as_json(
                {
                    "registrations": config["registrations"],
                    "severities": {
                        name: {"severities": severities}
                        for name, severities in config["readings"][
                            "severities"
                        ].items()
                    },
                    **JOINT_SIZES,
                    **JOINT_SECTIONS,
                }
            ),
        script:
            "../scripts/step.py"

    rule judge_joint:
        input:
            values=collect("<results>/joint_readings/{source}.csv", source=SOURCES),
            comparison="<results>/comparison.csv",
            readings="<results>/reading_verdicts.csv",
            development="<results>/joint_choice/scores.csv",
            code=code_files("gpca.experiments.joint_reading.verdict_step"),
        output:
            verdicts="<results>/joint_verdicts.csv",
            scores="<results>/joint_scores.csv",
        log:
            "<logs>/joint_verdicts.log",
        benchmark:
            "<benchmarks>/joint_verdicts.tsv"
        conda:
            "../envs/gpca.yaml"
        params:
            step="gpca.experiments.joint_reading.verdict_step",
            settings=as_json(
                {
                    "deals": JOINT["deals"],
                    "tolerances": config["comparison"]["tolerances"],
                }
            ),
        script:
            "../scripts/step.py"
