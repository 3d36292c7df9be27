# Settings and inputs of jobs of single topics, where they take more than a line; the linter wants them apart from rules.


def encoder_settings(wildcards, changes=None):
    """Return an encoder's section of the config, with changes and the ICP that a reading repeats."""
    icp = {"icp": config["registrations"]["icp"]}
    return as_json(config["encoders"][wildcards.backbone] | (changes or {}) | icp)


def but_published(names):
    """Return the pattern of these encoders or rows, without those as published, which have fewer seeds."""
    published = [*REAL_WORLD["published"].values(), *NAMES["published"]]
    return "|".join(name for name in names if name not in published) or "none"


def read_by_explainer(wildcards, seeds):
    """Return what an explainer reads of these seeds besides registrations, by option."""
    return {
        option: collect(f"<results>/{pattern}", source=wildcards.source, seed=seeds)
        for option, pattern in files_behind(wildcards.explainer, NAMES).items()
    }


def explainer_settings(wildcards):
    """Return the settings of an explainer in the config, or of one that is asked about frames alone."""
    name = explainer_of(wildcards.explainer, NAMES)
    return config["explainers"].get(name) or REAL_WORLD["explainers"].get(name) or {}


def controls_of(seed):
    """Return the controls of a seed: all, but those that need a further encoder for the first seeds alone."""
    further = int(seed) in CONTROL_SEEDS[: CONTROLS["encoder_seeds"]]
    return [
        name
        for name in CONTROLS["controls"]
        if further or name in OF_EVERY_SEED or name not in RETRAINED
    ]


def retrained(wildcards):
    """Return the controls and ways of training for which a seed has encoders of their own."""
    further = int(wildcards.seed) in CONTROL_SEEDS[: CONTROLS["encoder_seeds"]]
    own = [name for name in controls_of(wildcards.seed) if name in RETRAINED]
    return own + (NAMES["control_encoder"] if further else [])


def control_settings(wildcards, **further):
    own = {n: CONTROLS[n] for n in CONTROLS if n not in ("explainers", "hard")}
    own["controls"] = controls_of(wildcards.seed)
    encoder = config["encoders"][CONTROL_ENCODER]
    return as_json({"controls": own, "encoder": encoder, **further})


def samples_of_control(wildcards):
    """Return the registrations that the encoder of a control learns from."""
    folder = "hard" if wildcards.control == HARD else "registrations"
    return f"<results>/{folder}/{wildcards.source}/seed{wildcards.seed}.npz"


def hard_samples(wildcards):
    """Return the samples of the hard control, where it is among those of the seed."""
    asked = HARD in controls_of(wildcards.seed)
    return (
        f"<results>/hard/{wildcards.source}/seed{wildcards.seed}.npz" if asked else []
    )


def other_sources(wildcards):
    """Return the sources that explainers of this one are asked about besides, where there is transfer."""
    return [name for name in NAMES["transfer_source"] if name != wildcards.source]


def read_by(cause_explainer):
    """Return the folder of what an explainer of causes reads."""
    folders = {
        "embeddings": "cause_embeddings",
        REENACTED: "reenactments",
        BARE: "causes",
    }
    return folders.get(explainer_entry(cause_explainer, CAUSES).reads, "descriptors")


def if_enacted(files):
    """Return files of re-enactments where an explainer of causes reads any."""
    read = [
        explainer_entry(name, CAUSES).reads
        for name in config["diagnosis"]["explainers"]
    ]
    return files if REENACTED in read else []


def frame_diagnosis(explainers):
    """Return the settings of a job that asks some explainers of causes about depth frames."""
    asked = {name: config["diagnosis"]["explainers"][name] for name in explainers}
    icp = {"icp": config["registrations"]["icp"]}
    return as_json(config["diagnosis"] | icp | {"explainers": asked})


def estimator_settings(estimators):
    """Return the settings of a job that asks some estimators about registrations with measured causes."""
    names = ("estimator_pairs", "causes", "success")
    asked = {name: config["estimators"][name] for name in estimators}
    icp = {"icp": config["registrations"]["icp"]}
    return as_json({name: config[name] for name in names} | icp | {"estimators": asked})


def following_one(names, name):
    return names[(names.index(name) + 1) % len(names)]


def next_source(wildcards):
    """Return the source after this one, by which estimators are taught otherwise; none where it is the only one."""
    sources = list(SOURCES)
    return [following_one(sources, wildcards.source)] if len(sources) > 1 else []


def read_by_readings(wildcards):
    """Return what a group of readings reads, by kind of file."""
    group = GROUPS[wildcards.reading_group]
    if wildcards.reading_group == FRAME_INPUT:
        return read_by_frame_input()
    if wildcards.reading_group in (FRAME_ENCODER, FRAME_START):
        return read_by_frame_rows(wildcards.reading_group)
    sources = [name for name in group.sources if name in SOURCES]
    seeds = SEEDS[: 1 if group.costly else READINGS["seeds"]]
    ranges = []
    if wildcards.reading_group == SEVERITIES_RETRAINED:
        seeds = RETRAINED_SEEDS
        ranges = READINGS["groups"][SEVERITIES_RETRAINED]["range"]
    made = "predictions"
    methods = [name for name in group.methods if name in config["explainers"]]
    if wildcards.reading_group == "diagnostics":
        made = "learners"
        methods = [name for name in group.methods if name in config["learners"]]
    patterns = {
        "registrations": "<results>/registrations/{source}/seed{seed}.npz",
        "sets": "<results>/shifted/{source}/seed{seed}.npz",
        "predictions": f"<results>/{made}/{{source}}/{{method}}/seed{{seed}}.csv",
        "retrained": "<results>/retrained/{range}/{source}/seed{seed}.npz",
    }
    return {
        kind: collect(
            patterns[kind],
            source=sources,
            method=methods,
            range=ranges,
            seed=seeds,
        )
        for kind in group.reads
    }


def read_by_repeats(wildcards):
    """Return the frames of all seeds, what a backbone's rows say of them, and the first seed's embeddings."""
    of = {"source": FRAMES, "seed": SEEDS}
    reductions = REAL_WORLD["reductions"]
    return {
        "registrations": collect(
            "<results>/registrations/{source}/seed{seed}.npz", **of
        ),
        "predictions": collect(
            "<results>/predictions/{source}/{backbone}-{reduction}/seed{seed}.csv",
            backbone=wildcards.backbone,
            reduction=reductions,
            **of,
        ),
        "embeddings": collect(
            "<results>/embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz",
            source=FRAMES,
            backbone=wildcards.backbone,
            reduction=reductions,
            seed=SEEDS[0],
        ),
    }


def read_by_frame_input():
    """Return the frames of its seeds, what the protocol's encoder makes of them, and their embeddings by others."""
    of = {"source": FRAMES, "seed": SEEDS[: READINGS["frame_seeds"]]}
    return {
        "registrations": collect(
            "<results>/registrations/{source}/seed{seed}.npz", **of
        ),
        "predictions": collect(
            f"<results>/predictions/{{source}}/{BACKBONE}-none/seed{{seed}}.csv", **of
        ),
        "embeddings": collect(
            f"<results>/other_clouds/{{source}}/{BACKBONE}/{{cloud}}/seed{{seed}}.npz",
            cloud=OTHER_CLOUDS,
            **of,
        ),
    }


def seeds_of_frame_row(method):
    """Return the seeds of a row on depth frames."""
    return NAMES["published_seed"] if method in NAMES["published"] else SEEDS


def read_by_frame_rows(group):
    """Return the predictions of the judged rows on frames and of those in their place, and what they are of."""
    asked = {FRAMES: [*NAMES["backbone"], *NAMES["published"]]}
    if group == FRAME_START:
        asked = {
            FRAMES: NAMES["backbone"],
            NAMES["estimated"]: NAMES["condition_backbone"],
        }
    return {
        "registrations": collect(
            "<results>/registrations/{source}/seed{seed}.npz", source=asked, seed=SEEDS
        ),
        "predictions": [
            path
            for source, methods in asked.items()
            for method in methods
            for path in collect(
                "<results>/predictions/{source}/{method}/seed{seed}.csv",
                source=source,
                method=method,
                seed=seeds_of_frame_row(method),
            )
        ],
    }


def retrained_on(severities):
    """Return the section `registrations` with the severities of that name; the protocol's own where there are none."""
    other = READINGS["severities"].get(severities)
    return config["registrations"] | ({"severities": other} if other else {})


def other_cloud_settings(wildcards, changes):
    """Return the settings of an encoder of depth frames that sees another cloud, with changes, and the cloud."""
    icp = {"icp": config["registrations"]["icp"]}
    encoder = config["encoders"][BACKBONE] | (changes or {}) | icp
    return as_json(encoder | {"reading": wildcards.cloud})
