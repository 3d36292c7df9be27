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
