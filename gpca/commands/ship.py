"""Command ``ship``: the model of the package and its card, from the files of a run; for releases."""

import hashlib
import json
import re
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import NamedTuple

from gpca.errors import InputError
from gpca.io.files import require_apart, whole_file, write_text
from gpca.io.structured_text import load_own_yaml, read_json
from gpca.jobs.provenance import record_path
from gpca.model.diagnoser import ENDS
from gpca.model.file import VERSION, Model
from gpca.objects.canonical import ObjectClouds
from gpca.objects.sizes import LARGEST_DIAMETER_M, SMALLEST_DIAMETER_M
from gpca.pairs.perturbation import CONCEPTS

HELD_OUT = {  # measures of starts and results
    "auroc_failed": "AUROC of failed",
    "false_alarms": "good ones called failed",
    "missed": "failures called good",
}
STARTS = HELD_OUT | {"balanced_accuracy": "balanced accuracy", "dominant_accuracy": "dominant cause"}
COUNTS = ("good", "samples", "families")
LARGEST_BYTES = 8 * 10**6  # of the model file in every installation
LICENSES = Path(__file__).with_name("licenses.yaml")
CARD = Path(__file__).with_name("card.md")  # template
REMEDY = "ship a model from the folder of the run that made it"
_TRAINING_FILE = re.compile(r"/(model_causes|registrations)/([^/]+)/seed\d+\.npz$")  # among the inputs of a model

License = tuple[str, str, str]  # dataset, license, and where it was read


class Source(NamedTuple):
    """Training objects of a model."""

    title: str
    diagnosed: bool  # whether the diagnosis was trained on them
    objects: int | str  # their number; a dash without the file of the objects
    licenses: list[License]


def _sources(model: Path, record: Mapping, title: str) -> Iterator[Source]:
    """Yield the training objects of a model, in the order of its record, by the records in ``objects/`` of its run."""
    files = [match.groups() for path in record["inputs_sha256"] if (match := _TRAINING_FILE.search(f"/{path}"))]
    if not files:
        raise InputError(record_path(model), "lists nothing that a model learns from", REMEDY)
    for kind, name in files:
        objects = model.parent / f"objects/{name}.npz"
        made = read_json(record_path(objects), "a provenance record", REMEDY)
        settings = made["settings"]
        entry = settings.get("entry", {"title": title, "stand_in": "datasets" not in settings})
        if entry.get("stand_in"):
            raise InputError(objects, "contains objects that the package drew", "ship a model of real objects")
        downloads = settings["datasets"].values() if "datasets" in settings else [entry]
        origins = list(made["inputs_sha256"]) or [
            url for each in downloads for url in each.get("urls") or [each["url"]]
        ]
        licenses = list(dict.fromkeys(license for origin in origins for license in licenses_of(origin, objects)))
        number = len(ObjectClouds.load(objects)) if objects.is_file() else "–"
        yield Source(entry["title"], kind == "model_causes", number, licenses)


def licenses_of(origin: str, objects: Path) -> list[License]:
    licenses = [
        (dataset, entry["license"], entry["known"])
        for dataset, entry in load_own_yaml(LICENSES).items()
        if any(word in origin for word in entry["found"])
    ]
    if not licenses:
        fault = f"was made from '{Path(origin).name}', which is from a dataset without a known license"
        raise InputError(objects, fault, f"add the dataset to {LICENSES}")
    return licenses


def card(name: str, content: bytes, model: Model, record: Mapping, sources: Sequence[Source]) -> str:
    """Return the card in Markdown, the template with its fields; equal inputs give equal text."""
    diagnoser, code = model.diagnoser, record["code"]
    file = {
        "file": f"`{name}`, {len(content)} bytes, format version {VERSION}",
        "SHA-256": f"`{hashlib.sha256(content).hexdigest()}`",
        "precision": "that of the training; no number was rounded",
        "made by": f"version {code.get('version')} of the package, commit `{code.get('commit')}`"
        + (", with changes" if code.get("dirty") else ""),
        "settings": f"seed {record.get('seed')}, SHA-256 `{record.get('settings_sha256')}`",
    }
    training = [(source.title, source.objects, "diagnosis" if source.diagnosed else "GP-CA") for source in sources]
    used: dict[License, list[str]] = {}
    for source in sources:
        for license in source.licenses:
            used.setdefault(license, []).append(source.title)
    licenses = [(*license, "; ".join(dict.fromkeys(titles))) for license, titles in used.items()]
    changes = sorted(record["settings"].get("model", {}).get("causes", {}).items())
    fields = _limits(model, record["settings"]) | {
        "name": name,
        "concepts": ", ".join(CONCEPTS),
        "percent": "\u00a0%",
        "samples": diagnoser.classifier.samples,
        "learned": len(model.gpc.learned_N_d),
        "file": _table(["", ""], file.items()),
        "training": _table(["objects", "number", "train"], training),
        "licenses": _table(["dataset", "license", "source of this information", "part of"], licenses),
        "held_out": _held_out("", {"starts": diagnoser.held_out}, STARTS),
        "held_out_results": _held_out(
            "tolerance", {f"{100 * level.tolerance:g} %": level.held_out for level in diagnoser.levels}, HELD_OUT
        ),
        "changes": "\n".join(f"- `{key}: {json.dumps(value, sort_keys=True)}`" for key, value in changes) or "- none",
    }
    return Template(CARD.read_text(encoding="utf-8")).substitute(fields)


def _held_out(head: str, rows: Mapping[str, Mapping[str, float]], measures: Mapping[str, str]) -> str:
    def cell(row: Mapping[str, float], name: str) -> str:
        if name not in row:
            return "–"
        low, high = (row.get(name + end) for end in ENDS)
        return f"{row[name]:.3f}" + ("" if low is None or high is None else f" ({low:.3f} to {high:.3f})")

    lines = [
        (name, *(cell(row, measure) for measure in measures), *(f"{row[n]:.0f}" if n in row else "–" for n in COUNTS))
        for name, row in rows.items()
    ]
    return _table([head, *measures.values(), *COUNTS], lines)


def _limits(model: Model, settings: Mapping) -> dict[str, object]:
    causes, level = settings["causes"] | settings["model"].get("causes", {}), model.diagnoser.at_default
    if (guarantee := level.guarantee) is None:
        raise InputError("model", "is of a format that tells no result from its start", "make it again")
    sets, alarm = guarantee.state_sets, guarantee.failure_alarm
    return {
        "failed": f"{causes['limits']['failed']:g}",
        "severities": ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in causes["severities"].items()),
        "fewest": causes["points"][0],
        "most": causes["points"][1],
        "icp": model.icp.method,
        "tolerances": ", ".join(f"{100 * level.tolerance:g}" for level in model.diagnoser.levels),
        "threshold": f"{level.threshold:.3f}",
        "start_threshold": f"{model.diagnoser.start_threshold:.3f}",
        "called_failed": f"{100 * settings['model']['false_alarms']:g}",
        "level": f"{sets.level:g}",
        "counted": f"{guarantee.families} families, family by family" if guarantee.families else "single registrations",
        "missed": f"{100 * alarm.missed:g}",
        "false_alarms": f"{100 * alarm.false_alarms:g}",
        "calibrated": guarantee.samples,
        "familiar": ", ".join(f"{name} {low:.2f} to {high:.2f}" for name, (low, high) in model.familiar.ranges.items()),
        "smallest": f"{SMALLEST_DIAMETER_M:g}",
        "largest": f"{LARGEST_DIAMETER_M:g}",
    }


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def add_ship_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    folder = "model of a run, with the records of its folder, such as results/full/model.pt"
    add("--model", required=True, type=Path, help=folder)
    add("--out", required=True, type=Path, help="the model to ship, such as gpca/model/shipped.pt")
    add("--card", required=True, type=Path, help="its card, such as gpca/model/shipped.md")


def run_ship(options: Namespace) -> None:
    """Write both files or neither; the same run gives the same bytes."""
    require_apart(options, ["out", "card"], [record_path(options.model), options.model.with_name("objects")])
    model = Model.load(options.model)
    if model.stand_in:
        raise InputError(options.model, "was trained on objects that the package drew", "ship a model of real objects")
    with TemporaryDirectory() as folder:
        written = Path(folder) / "model.pt"
        model.save(written)
        content = written.read_bytes()
    if len(content) > LARGEST_BYTES:
        fault = f"has {len(content) / 1e6:.1f} MB, more than the {LARGEST_BYTES / 1e6:g} MB allowed in the package"
        raise InputError(options.model, fault, "lower causes.train, causes.test or real_world.train")
    record = read_json(record_path(options.model), "a provenance record", REMEDY)
    try:
        text = card(options.out.name, content, model, record, list(_sources(options.model, record, model.title)))
    except (KeyError, TypeError, AttributeError) as fault:
        raise InputError(options.model, f"has incomplete records of its run ({fault!r})", REMEDY) from fault
    with whole_file(options.out) as partial:
        partial.write_bytes(content)
    write_text(options.card, text)
