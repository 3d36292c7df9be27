# Failures on virtual tables, and what every policy makes of them -> recovery.csv.
from gpca.objects.source import data_files, data_folders, source_modules
from gpca.recovery.policies import policy_entry, policy_module

RECOVERY = config["recovery"]
STANDING = SOURCES[RECOVERY["objects"]]  # what stands on the tables
RECOVERY_EXPLAINERS = sorted(
    {
        entry.explainer
        for name in RECOVERY["policies"]
        if (entry := policy_entry(name, tuple(RECOVERY["actions"]))).explainer
    }
)
RECOVERY_SETTINGS = {
    "recovery": RECOVERY,
    "success": config["success"],
    "objects": config["sources"][RECOVERY["objects"]],
    "scenes": config["real_world"]["scenes"],
    "registrations": config["registrations"],
    "encoder": config["encoders"][config["embedding"]["encoder"]] | RECOVERY["encoder"],
    "uncertainty": config["uncertainty"].get("removal", {}),
    "reenactment": config["diagnosis"]["reenactment"],
    "explainers": {
        name: config["explainers"].get(name) or {} for name in RECOVERY_EXPLAINERS
    },
}


rule recover:
    input:
        data=data_files(STANDING),
        code=code_files(
            "gpca.steps.recovery",
            encoder_module(config["embedding"]["encoder"]),
            *map(explainer_module, RECOVERY_EXPLAINERS),
            *filter(None, map(policy_module, RECOVERY["policies"])),
            *source_modules(STANDING),
        ),
    output:
        rows="<results>/recovery/seed{seed}.csv",
        queue="<results>/recovery/queue_seed{seed}.csv",
        policy="<results>/recovery/policy_seed{seed}.json",
        example="<results>/recovery/example_seed{seed}.npz",
        timings="<results>/timings/recovery/seed{seed}.csv",
    log:
        "<logs>/recovery/seed{seed}.log",
    benchmark:
        "<benchmarks>/recovery/seed{seed}.tsv"
    priority: 6
    conda:
        "../envs/gpca.yaml"
    params:
        step="gpca.steps.recovery",
        settings=as_json(RECOVERY_SETTINGS),
        folders=data_folders(STANDING, config["data_dir"], config["downloads"]),
    script:
        "../scripts/step.py"
