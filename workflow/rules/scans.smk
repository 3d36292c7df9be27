# Data sets of scans -> pairs by overlap -> each registered by every method -> scans.csv.
from gpca.experiments.scans.experiment import present
from gpca.experiments.scans.settings import ChoiceSettings, TrialSettings
from gpca.scans.source import data_files as files_of_scans, place_of
from gpca.settings import fields_of

SCANS, SCAN_ENTRIES = config["scans"], present(config)


wildcard_constraints:
    scan_set="|".join(SCAN_ENTRIES),


rule scan_pairs:
    input:
        collect(
            "<results>/scans/{scan_set}/seed{seed}.npz",
            scan_set=NAMES["scan_set"],
            seed=NAMES["scan_seed"],
        ),


rule draw_scans:
    input:
        data=lambda wildcards: files_of_scans(
            SCAN_ENTRIES[wildcards.scan_set], config["data_dir"]
        ),
        code=code_files("gpca.steps.scans:draw_scans"),
    output:
        out="<results>/scans/{scan_set}/seed{seed}.npz",
    log:
        "<logs>/scans/{scan_set}/seed{seed}.log",
    benchmark:
        "<benchmarks>/scans/{scan_set}/seed{seed}.tsv"
    priority: 3
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.scans:draw_scans",
        source=lambda wildcards: wildcards.scan_set,
        settings=lambda wildcards: as_json(
            {
                "entry": SCANS["datasets"][wildcards.scan_set],
                "choice": fields_of(SCANS, ChoiceSettings),
                "role": config["splits"]["role"],
            }
        ),
        place=lambda wildcards: str(
            place_of(SCAN_ENTRIES[wildcards.scan_set], config["data_dir"]) or ""
        ),
    script:
        "../scripts/step.py"


rule register_scans:
    input:
        scans="<results>/scans/{scan_set}/seed{seed}.npz",
        code=code_files(
            "gpca.experiments.scans.step",
            *map(method_module, NAMES["scan_method"]),
        ),
    output:
        rows=collect(
            "<results>/scan_trials/{{scan_set}}/{method}/seed{{seed}}.csv",
            method=NAMES["scan_method"],
        ),
        timings=collect(
            "<results>/timings/{{scan_set}}/method_{method}/seed{{seed}}.csv",
            method=NAMES["scan_method"],
        ),
    log:
        "<logs>/scan_trials/{scan_set}/seed{seed}.log",
    benchmark:
        "<benchmarks>/scan_trials/{scan_set}/seed{seed}.tsv"
    priority: 2
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.experiments.scans.step",
        source=lambda wildcards: wildcards.scan_set,
        settings=as_json(
            {
                "scans": fields_of(SCANS, TrialSettings),
                "methods": {
                    name: SCANS["methods"].get(name) or config["methods"][name]
                    for name in NAMES["scan_method"]
                },
            }
        ),
        methods=NAMES["scan_method"],
    script:
        "../scripts/step.py"
