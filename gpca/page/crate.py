"""Describes a run as an RO-Crate 1.1 (process run profile): every result with the job that made it and its inputs."""

import json
import mimetypes
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

from gpca.io.files import write_text
from gpca.jobs.provenance import RECORD

NAME = "ro-crate-metadata.json"
SPECIFICATION = "https://w3id.org/ro/crate/1.1"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
CONTEXT = (f"{SPECIFICATION}/context", "https://w3id.org/ro/terms/workflow-run/context")
PAPER = "https://arxiv.org/abs/2509.18786"
PAPERS_TITLE = "Human-Interpretable Uncertainty Explanations for Point Cloud Registration"
MIT = "https://spdx.org/licenses/MIT"
RIGHTS = "The suite is under the MIT license; the datasets that the run read keep their own licenses."
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
    graph: dict[str, dict[str, Any]] = {}

    def entity(identifier: str, kind: str, **facts: Any) -> dict[str, str]:
        graph[identifier] = {"@id": identifier, "@type": kind, **facts}
        return {"@id": identifier}

    hashes = {path: digest for job in jobs for path, digest in job["inputs"].items()}
    parts = {}
    for path in sorted({path for job in jobs for path in job["outputs"]}):
        form = FORMS.get(Path(path).suffix) or mimetypes.guess_type(path)[0]
        known = {"encodingFormat": form, "sha256": hashes.get(path)}
        kind = "Dataset" if path.endswith("/") else "File"
        parts[path] = entity(path, kind, name=path, **{fact: value for fact, value in known.items() if value})
    files = parts | {
        path: entity(f"#input-{digest[:16]}", "CreativeWork", name=Path(path).name, sha256=digest)
        for path, digest in hashes.items()
        if path not in parts
    }
    actions = []
    for job in jobs:
        libraries = [
            entity(f"#{name}-{version.replace('+', '-')}", "SoftwareApplication", name=name, softwareVersion=version)
            for name, version in job["libraries"].items()
        ]
        commit, state = job["code"]["commit"] or "", "changed" if job["code"]["dirty"] else ""
        version = job["code"]["version"]
        software = entity(
            "#" + "-".join(filter(None, ("gpca-bench", version, commit[:12], state))),
            "SoftwareApplication",
            name="GP-CA Bench",
            softwareVersion=", ".join(filter(None, (version, commit and f"commit {commit}", state))),
            softwareRequirements=_one_or_all(libraries),
        )
        first, *others = outputs = job["outputs"]
        action = entity(
            f"#job-{sha256(' '.join(outputs).encode()).hexdigest()[:16]}",
            "CreateAction",
            name=f"Making {first}{f' and {len(others)} more' if others else ''}",
            description=f"{float(job['seconds']):g} s; settings and machine are in {first.rstrip('/')}{RECORD}",
            endTime=job["ended"].isoformat(),
            instrument=software,
            object=_one_or_all(files[path] for path in job["inputs"]),
            result=_one_or_all(files[path] for path in outputs),
        )
        actions.append(action)
    root = entity(
        "./",
        "Dataset",
        name=name,
        description=description,
        datePublished=max(job["ended"] for job in jobs).date().isoformat(),
        license=entity(MIT, "CreativeWork", name="MIT", description=RIGHTS),
        conformsTo=entity(PROFILE, "CreativeWork", name="Process Run Crate", version="0.5"),
        citation=entity(PAPER, "ScholarlyArticle", name=PAPERS_TITLE),
        hasPart=_one_or_all(parts.values()),
        mentions=_one_or_all(actions),
    )
    entity(NAME, "CreativeWork", about=root, conformsTo={"@id": SPECIFICATION})
    return {"@context": list(CONTEXT), "@graph": list(graph.values())}


def _one_or_all(references: Iterable[dict[str, str]]) -> dict[str, str] | list[dict[str, str]]:
    """Return each reference once; one alone is no list, as RO-Crate wants it."""
    distinct = list({reference["@id"]: reference for reference in references}.values())
    return distinct[0] if len(distinct) == 1 else distinct
