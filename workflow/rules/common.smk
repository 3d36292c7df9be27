# Names and functions that several files of rules share: seeds, sources, titles, sections of the config, code.
import json
from pathlib import Path

from gpca.experiments.active_learning import learning_settings
from gpca.experiments.claims import compared_sources
from gpca.explainers.interface import BARE, REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module
from gpca.alignment.methods.registry import method_module
from gpca.process.code_files import code_stamp
from gpca.encoders.registry import encoders
from gpca.objects.source import find_file
from gpca.experiments.frames import pretraining_of
from gpca.declarations.plan import Run, config_token
from gpca.experiments.run import names_of
from gpca.declarations.step import Plan
from gpca.frames.source import VIRTUAL

# An own kind of source is a file in sources/ that writes <results>/objects/<name>.npz and adds itself to SOURCES.
CONFIGURED_SOURCES = list(SOURCES)
for path in sorted(Path(workflow.current_basedir, "sources").glob("*.smk")):

    include: path


SEEDS = config["seeds"]
for name, entry in SOURCES.items():
    config["sources"].setdefault(name, entry)  # of a rule
NAMES = names_of(config, SOURCES)
PLAN = Plan(Run(config), NAMES, SOURCES)
TITLED = compared_sources(PLAN.run)
LEARNING_SETTINGS = learning_settings(PLAN)
FRAMES = NAMES["frames"]
FRAME_SEEDS = NAMES["frame_seed"]
EMBEDDING = NAMES["embedding"]
REDUCTIONS = [name for name in config["reductions"] if name != "none"]
PRETRAINED_ON = [*SOURCES, *([VIRTUAL] if config["real_world"]["virtual"] else [])]
EXPLAINED = [
    *config["explainers"],
    *NAMES["frame_explainer"],
    *NAMES["backbone"],
    *NAMES["published"],
]


wildcard_constraints:
    source="|".join([*SOURCES, FRAMES, *NAMES["condition"]]),
    seed=r"\d+",
    backbone="|".join(config["encoders"]),
    reduction="|".join(REDUCTIONS),
    explainer="|".join(EXPLAINED),
    cause_explainer="|".join(config["diagnosis"]["explainers"]),
    design="|".join(config["uncertainty"]),


def settings(*keys):
    """Return the config's section at the wildcard-named keys as JSON."""

    def section(wildcards):
        found = config
        for key in keys:
            found = found[key.format(**wildcards)]
        return json.dumps(found or {}, sort_keys=True)

    return section


def split_file(kind):
    """Return the file that says which objects or scenes are for what, or nothing where they are drawn."""
    name = config["splits"][kind]
    return find_file(name, config["data_dir"]) if name else []


def as_json(section):
    return json.dumps(section, sort_keys=True)


def encoder_module(encoder):
    return backbone_module(config["encoders"][encoder])


def backbone_module(settings):
    return encoders()[settings["backbone"]].split(":")[0]


def encoder_code(step):
    return lambda wildcards: code_stamp(
        f"gpca.steps.pairs:{step}", encoder_module(wildcards.backbone)
    )


def code_of(modules):
    """Return the stamp of modules, or of those of a job."""
    if callable(modules):
        return lambda wildcards: code_stamp(*modules(wildcards))
    return code_stamp(*modules)


def collector_code(function):
    return code_stamp(function.split(":")[0], "gpca.jobs.job")


def below_results(files):
    """Return the files of each name below the folder of the run; functions of wildcards return such files."""

    def below(paths):
        if callable(paths):
            return lambda wildcards: below(paths(wildcards))
        return f"<results>/{paths}" if isinstance(paths, str) else [*map(below, paths)]

    return {name: below(paths) for name, paths in files.items()}


def token_of(file):
    """Return the token of the config for a file whose function is given the run (gpca/declarations/plan.py)."""
    sidecar = f"results/{config['run']}/{file}.provenance.json"
    return lambda wildcards: config_token(config, sidecar)
