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


<<<<<<< HEAD
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
=======
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
>>>>>>> a4ec3b10 (Controls are three files and the steps that draw their samples and explain under them; changes, leads and gains are rows with what they are against)


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


def seeds_of_frame_row(method):
    """Return the seeds of a row on depth frames."""
    return NAMES["published_seed"] if method in NAMES["published"] else SEEDS
