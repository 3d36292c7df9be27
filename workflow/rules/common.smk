import json
import os
import shlex
from pathlib import Path

from gpca.active_learning.acquisition import STRATEGIES as ACQUISITION, STREAMS
from gpca.code_files import code_files
from gpca.encoders.registry import ENCODERS
from gpca.frames.source import REAL_WORLD, frame_files
from baselines.registry import explainer_entry, explainer_module
from gpca.objects.procedural import FAMILIES
from gpca.objects.source import data_files
from gpca.recovery.policies import policy_entry
from gpca.comparison.published import PUBLISHED, read_published
from gpca.comparison.reasons import REASONS
from gpca.reporting.tables.backbones import CLASSIC as CLASSIC_TITLES, encoder_title
from gpca.reporting.tables.kernel_grid import kernel_tables_of
from gpca.reporting.figures.learners import LEARNER_FIGURES
from gpca.reporting.tables.learners import LEARNER_TABLES
from gpca.reporting.tables.active_learning import LEARNING_TABLES
from gpca.reporting.figures.pipeline import TITLES as PIPELINE_STRATEGIES
from gpca.reporting.sections import caption_files, section_of, title_of_result
from gpca.objects.title import title_of
from gpca.reporting.tables.explainers import GPCA_FORMS, TABLE1

PUBLISHED_NUMBERS = os.path.relpath(PUBLISHED)
SEEDS = config["seeds"]
REDUCTIONS = list(config["reductions"])
EMBEDDING = f"{config['embedding']['encoder']}/{config['embedding']['reduction']}"
STRATEGIES = config["active_learning"]["strategies"]
POOL_STRATEGIES = [name for name in STRATEGIES if name in ACQUISITION]
STRATEGY_TITLES = {
    name: ACQUISITION[name].title if name in ACQUISITION else STREAMS[name]
    for name in STRATEGIES
}

# A kind of source of its own: a rule file that writes results/{run}/objects/<name>.npz and adds itself to SOURCES.
CONFIGURED_SOURCES = list(SOURCES)
for path in sorted(Path(workflow.basedir, "workflow/rules/sources").glob("*.smk")):

    include: path


wildcard_constraints:
    source="|".join([*SOURCES, REAL_WORLD]),
    backbone="|".join(config["encoders"]),
    explainer="|".join(config["explainers"]),
    design="|".join(config["uncertainty"]),


def reported(path):
    """A table or figure as Snakemake's report shows it: by the paper's section, with title and caption."""

    def name(wildcards):
        return Path(path).stem.format(**wildcards)

    return report(
        path,
        caption="../report/result.rst",
        category=lambda wildcards: section_of(name(wildcards)),
        labels=lambda wildcards: {"result": title_of_result(name(wildcards))},
    )


def settings(*keys):
    """Return the config's section at the wildcard-named keys as JSON, for --settings."""

    def section(wildcards):
        found = config
        for key in keys:
            found = found[key.format(**wildcards)]
        return json.dumps(found or {}, sort_keys=True)

    return section


def objects_code(wildcards):
    entry = SOURCES[wildcards.source]
    modules = ["gpca.steps.objects", f"gpca.objects.{entry['kind']}"]
    if entry["kind"] == "procedural":
        modules.append(f"gpca.objects.shapes.{FAMILIES[entry['family']]}")
    return code_files(*modules)


def data_option(wildcards):
    """The one folder that the source's data comes from, and no other: a change of that one makes it anew."""
    option, key = {
        "local": ("--data-dir", "data_dir"),
        "download": ("--downloads", "downloads"),
    }.get(SOURCES[wildcards.source]["origin"], (None, None))
    return f"{option} {shlex.quote(config[key])}" if key and config[key] else ""


def encoder_module(encoder):
    return ENCODERS[config["encoders"][encoder]["backbone"]].split(":")[0]


def encoder_code(step):
    return lambda wildcards: code_files(
        f"gpca.steps.{step}", encoder_module(wildcards.backbone)
    )


def explainer_inputs(wildcards):
    """What the explainer reads besides the registrations, and the seconds that were spent before it starts."""
    encoder = config["embedding"]["encoder"]
    entry = explainer_entry(wildcards.explainer)
    embedded = entry.reads == "embeddings"
    place = f"{wildcards.run}/{{}}/{wildcards.source}"
    inputs = {
        "timings": f"results/{place.format('timings')}/{encoder if embedded else 'icp'}/seed{{seed}}.csv"
    }
    if embedded:
        inputs["embeddings"] = (
            f"results/{place.format('embeddings')}/{EMBEDDING}/seed{{seed}}.npz"
        )
    if entry.design:
        inputs["uncertainty"] = (
            f"results/{place.format('uncertainty')}/{entry.design}/seed{{seed}}.npz"
        )
        inputs["uncertainty_timings"] = (
            f"results/{place.format('timings')}/uncertainty_{entry.design}/seed{{seed}}.csv"
        )
    return {name: collect(pattern, seed=SEEDS) for name, pattern in inputs.items()}


def attached_options(wildcards, input):
    names = [
        name
        for name in ("embeddings", "uncertainty", "uncertainty_timings")
        if input.get(name)
    ]
    return [
        word
        for name in names
        for word in (f"--{name.replace('_', '-')}", *input.get(name))
    ]


SHOWN_SOURCES = {
    name: {"title": entry["title"], "stand_in": entry["stand_in"]}
    for name, entry in SOURCES.items()
}


def of_all_explainers(kind, explainers=config["explainers"]):
    return collect(
        f"results/{{{{run}}}}/{kind}/{{source}}/{{explainer}}/seed{{seed}}.csv",
        source=SOURCES,
        explainer=explainers,
        seed=SEEDS,
    )


def learning_curves(strategies):
    return collect(
        "results/{{run}}/active_learning/{source}/{strategy}/seed{seed}.csv",
        source=SOURCES,
        strategy=strategies,
        seed=SEEDS,
    )


def frames_inputs(wildcards):
    """The files of the datasets that the config names, or the scenes that stand in for them."""
    if not config["real_world"]["datasets"]:
        return {"scenes": f"results/{wildcards.run}/scenes/{REAL_WORLD}"}
    return {"data": frame_files(config["real_world"]["datasets"], config["data_dir"])}


def frames_option(wildcards, input):
    if input.get("scenes"):
        return f"--scenes {input.scenes}"
    named = {"--data-dir": config["data_dir"], "--downloads": config["downloads"]}
    return " ".join(
        f"{option} {shlex.quote(folder)}" for option, folder in named.items() if folder
    )


# Rows of Table VI: GP-CA on every backbone and reduction, and the classic features where they are switched on.
BACKBONES = [
    f"{backbone}-{reduction}"
    for backbone in config["real_world"]["backbones"]
    for reduction in config["real_world"]["reductions"]
]
SHOWN_BACKBONES = [
    name
    for name in BACKBONES
    if name.endswith(f"-{config['real_world']['reductions'][0]}")
]
REAL_WORLD_SHOWN = {
    "title": config["real_world"]["title"],
    "stand_in": not config["real_world"]["datasets"],
}
REAL_WORLD_TITLE = title_of(REAL_WORLD_SHOWN)
CLASSIC = [name for name in CLASSIC_TITLES if name in config["explainers"]]


def real_world_predictions(methods):
    return collect(
        f"results/{{{{run}}}}/predictions/{REAL_WORLD}/{{method}}/seed{{seed}}.csv",
        method=methods,
        seed=SEEDS,
    )


KERNEL_TABLES = kernel_tables_of(config["kernel_grid"])
KERNEL_GRIDS = collect(
    "results/{{run}}/kernels/{source}/seed{seed}.csv",
    source=config["kernel_grid"]["sources"],
    seed=SEEDS,
)
KERNEL_SOURCES = {
    name: entry
    for name, entry in SHOWN_SOURCES.items()
    if name in config["kernel_grid"]["sources"]
}
# A learner that is an explainer of the config too has its settings, and those of its own besides.
LEARNER_SETTINGS = {
    name: (config["explainers"].get(name) or {}) | (own or {})
    for name, own in config["learners"].items()
}
LEARNER_TITLES = {
    name: explainer_entry(name).title.removesuffix(" on the embedding")
    for name in LEARNER_SETTINGS
}


def of_all_learners():
    return collect(
        "results/{{run}}/learners/{source}/{learner}/seed{seed}.csv",
        source=SOURCES,
        learner=LEARNER_SETTINGS,
        seed=SEEDS,
    )


def shift_inputs(wildcards):
    """What a source's shifted sets are made from; the source that its encoder never saw is the first other one."""
    other = next((name for name in SOURCES if name != wildcards.source), None)
    encoder = config["embedding"]["encoder"]
    own = f"results/{wildcards.run}/{{}}/{wildcards.source}"
    inputs = {
        "registrations": f"{own.format('registrations')}/seed{{seed}}.npz",
        "embeddings": f"{own.format('embeddings')}/{EMBEDDING}/seed{{seed}}.npz",
        "encoders": f"{own.format('encoders')}/{encoder}/seed{{seed}}.pt",
    }
    if other:
        inputs["other"] = (
            f"results/{wildcards.run}/registrations/{other}/seed{{seed}}.npz"
        )
    files = {name: collect(pattern, seed=SEEDS) for name, pattern in inputs.items()}
    return files | {"objects": f"{own.format('objects')}.npz"}


# The explainers that each table shows: asked for alone, a table builds these and nothing else. No table without any.
TABLE_EXPLAINERS = {
    table: shown
    for table, names in {
        "table1_single_baselines": TABLE1,
        "table1_extended": config["explainers"],
        "table2_per_concept": GPCA_FORMS,
    }.items()
    if (shown := [name for name in config["explainers"] if name in names])
}


def table_inputs(wildcards):
    """The predictions of the explainers that it shows, or all that was collected, times included."""
    if wildcards.table == "table1_extended":
        files = [
            f"results/{wildcards.run}/{name}.csv" for name in ("metrics", "timings")
        ]
        return {"collected": files}
    patterns = of_all_explainers("predictions", TABLE_EXPLAINERS[wildcards.table])
    return {"predictions": [pattern.format(run=wildcards.run) for pattern in patterns]}


REAL_WORLD_FIGURES = [
    "fig5_real_world_example",
    "confusion_real_world",
    "real_world_failures",
]
RECOVERY = config["recovery"]
POLICY_ENTRIES = {
    name: policy_entry(name, tuple(RECOVERY["actions"]))
    for name in RECOVERY["policies"]
}
POLICIES = {name: entry.title for name, entry in POLICY_ENTRIES.items()}
RECOVERY_EXPLAINERS = sorted(
    {entry.explainer for entry in POLICY_ENTRIES.values() if entry.explainer}
)
RECOVERY_FIGURES = {  # and what each is drawn from
    "recovery_rates": "recovery.csv",
    "fig6_mitigation": f"recovery/policy_seed{SEEDS[0]}.json",
    "fig1_recovery_example": f"recovery/example_seed{SEEDS[0]}.npz",
}
# One registration of the source that figures show, and what the stages of GP-CA make of it.
GPCA_SHOWN = next((name for name in reversed(GPCA_FORMS) if name in config["explainers"]), "")
SHOWN_STAGES = {
    name: f"results/{{run}}/{name}/{config['figures']['source']}/{folder}seed{SEEDS[0]}.{suffix}"
    for name, folder, suffix in (
        ("registrations", "", "npz"),
        ("embeddings", f"{EMBEDDING}/", "npz"),
        ("predictions", f"{GPCA_SHOWN}/", "csv"),
    )
}
SHOWN_STRATEGIES = [name for name in PIPELINE_STRATEGIES if name in STRATEGIES]
METHOD_FIGURES = [
    *(["fig2_overview"] if GPCA_SHOWN else []),
    *(["fig4_pipeline"] if GPCA_SHOWN and SHOWN_STRATEGIES else []),
]
FIGURES = [
    *METHOD_FIGURES,
    *REAL_WORLD_FIGURES,
    "fig3_concepts",
    "fig_attribution_confusions",
    "active_learning_curves",
    "kernel_learning_curves",
    *LEARNER_FIGURES,
    *RECOVERY_FIGURES,
    "runtime",
    *(f"objects_{source}" for source in SOURCES),
]
RESULTS = [
    *("metrics.csv", "timings.csv", "active_learning.csv"),
    *("real_world.csv", "diagnostics.csv", "kernels.csv", "model.pt", "runtime.csv"),
    *("recovery.csv", "comparison.md"),
    *(
        f"tables/{table}.md"
        for tables in (TABLE_EXPLAINERS, LEARNING_TABLES, KERNEL_TABLES, LEARNER_TABLES)
        for table in tables
    ),
    *(
        "tables/table6_backbones.md",
        "tables/table7_runtime.md",
        "tables/table8_recovery.md",
    ),
    *(f"figures/{figure}.png" for figure in FIGURES),
    "index.html",
]
