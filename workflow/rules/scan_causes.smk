# Data sets of scans -> registrations with measured causes, and what explainers read of them -> what explainers say.
from gpca.experiments.scan_causes.experiment import (
    diagnosis_settings,
    measurement_settings,
    settings_of_explainers,
)

from gpca.experiments.scans import present
from gpca.scans.source import data_files as files_of_scans, place_of

SCAN_CAUSES = config["scan_causes"]
SCAN_ENTRIES = present(config)


wildcard_constraints:
    scan_set="|".join(SCAN_ENTRIES),


rule scan_causes:
    input:
        collect(
            "<results>/scan_causes/{scan_set}/seed{seed}.npz",
            scan_set=NAMES["scan_set"],
            seed=NAMES["scan_seed"],
        ),


rule measure_scan_causes:
    input:
        data=lambda wildcards: files_of_scans(
            SCAN_ENTRIES[wildcards.scan_set], config["data_dir"]
        ),
        code=code_files(
            "gpca.experiments.scan_causes.step",
            method_module(config["scans"]["global_start"]),
        ),
    output:
        scan_causes="<results>/scan_causes/{scan_set}/seed{seed}.npz",
        samples="<results>/scan_causes/{scan_set}/seed{seed}.csv",
        descriptors="<results>/scan_descriptors/{scan_set}/seed{seed}.npz",
        reenactments="<results>/scan_reenactments/{scan_set}/seed{seed}.npz",
    log:
        "<logs>/scan_causes/{scan_set}/seed{seed}.log",
    benchmark:
        "<benchmarks>/scan_causes/{scan_set}/seed{seed}.tsv"
    priority: 10
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.scan_causes.step",
        source=lambda wildcards: wildcards.scan_set,
        place=lambda wildcards: str(
            place_of(SCAN_ENTRIES[wildcards.scan_set], config["data_dir"]) or ""
        ),
        settings=lambda wildcards: as_json(
            measurement_settings(config, wildcards.scan_set)
        ),
    script:
        "../scripts/step.py"


rule diagnose_scans:
    input:
        scan_causes=collect(
            "<results>/scan_causes/{scan_set}/seed{{seed}}.npz",
            scan_set=NAMES["scan_set"],
        ),
        scan_descriptors=collect(
            "<results>/scan_descriptors/{scan_set}/seed{{seed}}.npz",
            scan_set=NAMES["scan_set"],
        ),
        scan_reenactments=collect(
            "<results>/scan_reenactments/{scan_set}/seed{{seed}}.npz",
            scan_set=NAMES["scan_set"],
        ),
        causes=collect("<results>/causes/{source}/seed{{seed}}.npz", source=SOURCES),
        descriptors=collect(
            "<results>/descriptors/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        reenactments=collect(
            "<results>/reenactments/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        encoders=collect(
            "<results>/cause_encoders/{source}/seed{{seed}}.pt", source=SOURCES
        ),
        embeddings=collect(
            "<results>/cause_embeddings/{source}/seed{{seed}}.npz", source=SOURCES
        ),
        code=code_files(
            "gpca.experiments.scan_causes.diagnosis_step",
            backbone_module(DIAGNOSIS["encoder"]),
            *(explainer_module(name, CAUSES) for name in SCAN_CAUSES["explainers"]),
        ),
    output:
        predictions="<results>/scan_diagnoses/seed{seed}.csv",
    log:
        "<logs>/scan_diagnoses/seed{seed}.log",
    benchmark:
        "<benchmarks>/scan_diagnoses/seed{seed}.tsv"
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.scan_causes.diagnosis_step",
        source="scans",
        settings=as_json(
            diagnosis_settings(
                config, SCAN_CAUSES["explainers"], settings_of_explainers(config)
            )
        ),
    script:
        "../scripts/step.py"
