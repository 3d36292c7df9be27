import json
import shlex
from pathlib import Path

from gpca.code_files import code_files
from gpca.encoders.registry import ENCODERS
from gpca.explainer import explainer_entry, explainer_module
from gpca.objects.procedural import FAMILIES
from gpca.objects.source import data_files
from gpca.reporting.tables import GPCA, title_of

SEEDS = config["seeds"]

# A kind of source of its own: a rule file that writes results/{run}/objects/<name>.npz and adds itself to SOURCES.
CONFIGURED_SOURCES = list(SOURCES)
for path in sorted(Path(workflow.basedir, "workflow/rules/sources").glob("*.smk")):

    include: path


wildcard_constraints:
    source="|".join(SOURCES),
    backbone="|".join(config["encoders"]),
    explainer="|".join(config["explainers"]),


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


def encoder_code(step):
    def files(wildcards):
        backbone = config["encoders"][wildcards.backbone]["backbone"]
        return code_files(f"gpca.steps.{step}", ENCODERS[backbone].split(":")[0])

    return files


def explainer_inputs(wildcards):
    """Embeddings for explainers that read them, and the seconds that were spent before the explainer starts."""
    encoder = config["embedding"]["encoder"]
    embedded = explainer_entry(wildcards.explainer).reads == "embeddings"
    place = f"{wildcards.run}/{{}}/{wildcards.source}"
    inputs = {
        "timings": f"results/{place.format('timings')}/{encoder if embedded else 'icp'}/seed{{seed}}.csv"
    }
    if embedded:
        folder = f"{encoder}/{config['embedding']['reduction']}"
        inputs["embeddings"] = (
            f"results/{place.format('embeddings')}/{folder}/seed{{seed}}.npz"
        )
    return {name: collect(pattern, seed=SEEDS) for name, pattern in inputs.items()}


def of_all_explainers(kind, explainers=None):
    return collect(
        f"results/{{{{run}}}}/{kind}/{{source}}/{{explainer}}/seed{{seed}}.csv",
        source=SOURCES,
        explainer=explainers or list(config["explainers"]),
        seed=SEEDS,
    )


# The explainers that each table shows: asked for alone, a table builds these and nothing else.
TABLE_EXPLAINERS = {
    "table1_single_baselines": list(config["explainers"]),
    "table2_per_concept": [name for name in config["explainers"] if name in GPCA],
}


def table_predictions(wildcards):
    return [
        path.format(run=wildcards.run)
        for path in of_all_explainers("predictions", TABLE_EXPLAINERS[wildcards.table])
    ]


FIGURES = ["fig3_concepts", *(f"objects_{source}" for source in SOURCES)]
