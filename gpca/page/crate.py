"""Describes a run as an RO-Crate 1.1 (process run profile): every result with the job that made it and its inputs."""

import json
import mimetypes
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

from gpca.errors import InputError
from gpca.io.files import write_text
from gpca.jobs.provenance import RECORD

NAME = "ro-crate-metadata.json"
SPECIFICATION = "https://w3id.org/ro/crate/1.1"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
CONTEXT = (f"{SPECIFICATION}/context", "https://w3id.org/ro/terms/workflow-run/context")
PAPER = "https://arxiv.org/abs/2509.18786"
LICENSE = {
    "@id": "https://spdx.org/licenses/MIT",
    "@type": "CreativeWork",
    "name": "MIT",
    "description": "The suite is under the MIT license; the datasets that the run read keep their own licenses.",
}
FORMS = {".npz": "application/zip", ".pt": "application/zip"}  # unknown to Python


def write_crate(folder: str | Path, run: str, sources: Iterable[str], seeds: Sequence[int]) -> None:
    """Write ``ro-crate-metadata.json`` of a run from all provenance records below its folder ``results/{run}``."""
    description = (
        "Explanations of uncertain point cloud registrations: tables, figures and the numbers behind them, on "
        f"{', '.join(sources)}; seeds {', '.join(map(str, seeds))}."
    )
    document = crate(read_jobs(Path(folder)), f"GP-CA Bench: run {run}", description)
    write_text(Path(folder, NAME), json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def read_jobs(folder: Path) -> list[dict[str, Any]]:
    """Return the records of a run's jobs but the one that writes the crate, each once with all its ``outputs``."""

    def relative(path: Path) -> str:
        return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)

    paths_of = defaultdict(list)  # a job left the same record beside each of its outputs
    for path in sorted(folder.rglob(f"*{RECORD}")):
        paths_of[path.read_bytes()].append(path)
    if not paths_of:
        raise InputError(folder, f"has no *{RECORD}", "name the folder of a finished run")
    jobs = []
    for text, paths in paths_of.items():
        if folder / f"{NAME}{RECORD}" not in paths:
            record, outputs = json.loads(text), [path.with_name(path.name.removesuffix(RECORD)) for path in paths]
            record["outputs"] = [relative(path) + ("/" if path.is_dir() else "") for path in outputs]
            record["inputs"] = {relative(Path(path)): sha for path, sha in record["inputs_sha256"].items()}
            record["ended"] = datetime.fromtimestamp(int(paths[0].stat().st_mtime), UTC)
            jobs.append(record)
    return jobs


def crate(jobs: Sequence[Mapping[str, Any]], name: str, description: str) -> dict[str, Any]:
    """Return the metadata document: ``@context`` and the flat ``@graph`` of entities that refer to each other."""
    hashes = {path: digest for job in jobs for path, digest in job["inputs"].items()}
    parts = sorted({path for job in jobs for path in job["outputs"]})
    identifiers = {path: f"#input-{digest[:16]}" for path, digest in hashes.items()} | {path: path for path in parts}
    entities: list[dict[str, Any]] = []
    for path in parts:
        form = FORMS.get(Path(path).suffix) or mimetypes.guess_type(path)[0]
        entity = {"@id": path, "@type": "Dataset" if path.endswith("/") else "File", "name": path}
        entity |= {"encodingFormat": form} if form else {}
        entities.append(entity | ({"sha256": hashes[path]} if path in hashes else {}))
    entities += [
        {"@id": identifiers[path], "@type": "CreativeWork", "name": Path(path).name, "sha256": digest}
        for path, digest in hashes.items()
        if identifiers[path] != path
    ]
    entities += [_software(job) for job in jobs]
    entities += [_library(*library) for job in jobs for library in job["libraries"].items()]
    actions = []
    for job in jobs:
        first, *others = outputs = job["outputs"]
        action = {
            "@id": f"#job-{sha256(' '.join(outputs).encode()).hexdigest()[:16]}",
            "@type": "CreateAction",
            "name": f"Making {first}{f' and {len(others)} more' if others else ''}",
            "description": f"{float(job['seconds']):g} s; settings and machine are in {first.rstrip('/')}{RECORD}",
            "endTime": job["ended"].isoformat(),
            "instrument": {"@id": _software(job)["@id"]},
            "object": _references(identifiers[path] for path in job["inputs"]),
            "result": _references(outputs),
        }
        actions.append(action)
    title = "Human-Interpretable Uncertainty Explanations for Point Cloud Registration"
    described: list[dict[str, Any]] = [
        {"@id": NAME, "@type": "CreativeWork", "about": {"@id": "./"}, "conformsTo": {"@id": SPECIFICATION}},
        {
            "@id": "./",
            "@type": "Dataset",
            "name": name,
            "description": description,
            "datePublished": max(job["ended"] for job in jobs).date().isoformat(),
            "license": {"@id": LICENSE["@id"]},
            "conformsTo": {"@id": PROFILE},
            "citation": {"@id": PAPER},
            "hasPart": _references(parts),
            "mentions": _references(action["@id"] for action in actions),
        },
        {"@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"},
        {"@id": PAPER, "@type": "ScholarlyArticle", "name": title},
        LICENSE,
    ]
    graph = {entity["@id"]: entity for entity in (*described, *entities, *actions)}
    return {"@context": list(CONTEXT), "@graph": list(graph.values())}


def _software(job: Mapping[str, Any]) -> dict[str, Any]:
    """Return the suite in one state of its code."""
    code = job["code"]
    commit = f", commit {code['commit']}" if code["commit"] else ""
    changed = " with uncommitted changes" if code["dirty"] else ""
    parts = ["gpca-bench", code["version"], (code["commit"] or "")[:12], "changed" if code["dirty"] else ""]
    return {
        "@id": f"#{'-'.join(filter(None, parts))}",
        "@type": "SoftwareApplication",
        "name": "GP-CA Bench",
        "softwareVersion": f"{code['version']}{commit}{changed}",
        "softwareRequirements": _references(_library(*library)["@id"] for library in job["libraries"].items()),
    }


def _library(name: str, version: str) -> dict[str, Any]:
    identifier = f"#{name}-{version.replace('+', '-')}"
    return {"@id": identifier, "@type": "SoftwareApplication", "name": name, "softwareVersion": version}


def _references(identifiers: Iterable[str]) -> dict[str, str] | list[dict[str, str]]:
    """Return references to entities; one alone is no list, as RO-Crate wants it."""
    references = [{"@id": identifier} for identifier in dict.fromkeys(identifiers)]
    return references[0] if len(references) == 1 else references
