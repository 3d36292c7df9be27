"""Writes a run as one plain web page that works from disk: findings, comparison, tables, figures, registrations."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gpca.alignment.icp import ICPSettings
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.io.files import whole_file
from gpca.model.scene import ASSETS
from gpca.page import cause_samples, samples
from gpca.page.comparison import page_comparison
from gpca.page.findings import Titles, findings_of
from gpca.page.links import Links
from gpca.page.scenes import POINTS
from gpca.page.tables import in_groups
from gpca.process.provenance import sha256_of_settings
from gpca.reporting.registry import SUFFIXES, by_section

TEMPLATES = Path(__file__).parent / "templates"
KEY_FIGURES = ("causes_example", "fig2_overview")  # The page opens with the first of these that the run has.
_CSS_PIXELS = 170 / 300  # A figure's pixel, of 300 in an inch, takes this many: its letters are as large as the text's.


@dataclass(frozen=True)
class Shown:
    """A table or figure as the page shows it; the attributes are those of :class:`gpca.reporting.registry.Result`."""

    name: str
    kind: str
    section: str
    title: str
    caption: str


@dataclass(frozen=True)
class Run:
    """Holds what the page says of a run besides its results.

    Attributes:
        name: The name of the run.
        seeds: The seeds of its repeats.
        sources: The ``{"title": str, "stand_in": bool}`` of each name.
        results: Its tables and figures, in order.
        samples: The files of each source whose registrations are shown, by name
            (:func:`gpca.page.samples.page_samples`).
        causes: The files of each source whose failures are shown with their causes, by name
            (:func:`gpca.page.cause_samples.cause_samples`).
        titles: What readers call the explainers of the run.
        reference: The ``comparison.csv`` of a run on real objects, shown where nothing of this run is judged.
        config: The whole configuration.
        command: The command that makes what is missing.
    """

    name: str
    seeds: Sequence[int]
    sources: Mapping[str, Mapping]
    results: Sequence[Shown]
    samples: Mapping[str, Mapping[str, str]]
    causes: Mapping[str, Mapping[str, str]]
    titles: Titles
    reference: str | None
    config: Mapping
    command: str


def write_page(folder: str | Path, run: Run) -> None:
    """Write ``index.html`` of a finished run into its folder; it needs nothing but the tables and figures beside it.

    Comparison and findings are shown where the folder has the collected files, such as ``comparison.csv``.

    Args:
        folder: The folder ``results/{run}``.
        run: The run that is shown.

    Raises:
        InputError: A file is missing (the line names all that are, and how to make them) or unusable.
    """
    folder = Path(folder)
    require_complete(folder, run)
    shown = {result.name for result in run.results}
    links = Links(folder, shown)
    sections = {
        section: [_content(folder, result, run, links) for result in results]
        for section, results in by_section(run.results).items()
    }
    key_figure = next((result for name in KEY_FIGURES for result in run.results if result.name == name), None)
    text = render(
        run=run,
        findings=findings_of(folder, run.titles, shown),
        key_figure=key_figure and _content(folder, key_figure, run, links),
        sections=sections,
        comparison=page_comparison(folder / "comparison.csv", run.reference),
        links=links,
        samples=_samples(run),
        provenance=read_provenance(_provenance_files(folder, run)),
    )
    with whole_file(folder / "index.html") as partial:
        partial.write_text(text, encoding="utf-8")


def render(template: str = "index.html.jinja", **content) -> str:
    """Return a page's HTML; everything that comes from files is escaped."""
    import yaml
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader([TEMPLATES, ASSETS]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["anchor"] = lambda title: re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
    environment.filters["short"] = _short
    environment.filters["yaml"] = lambda value: yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=100)
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "sort_keys": True}
    words = {"samples_rule": samples.RULE, "causes_rule": cause_samples.RULE, "samples_points": POINTS}
    return environment.get_template(template).render(**content, **words)


def _short(section: str) -> str:
    """Return the title of a section as the menu has it."""
    words = section.removeprefix("Beyond the paper: ")
    return words[:1].upper() + words[1:]


def require_complete(folder: Path, run: Run) -> None:
    """Raise an InputError that names every result of the run that is not there, and the command that makes it."""
    needed = [f"{each.kind}/{each.name}.{suffix}" for each in run.results for suffix in SUFFIXES[each.kind]]
    missing = [name for name in needed if not (folder / name).is_file()]
    missing += [str(path) for path in _files_of_samples(run) if not path.is_file()]
    if missing:
        raise InputError(folder, f"lacks {', '.join(missing)}", f"make them with '{run.command}'")


def read_provenance(files: Iterable[Path]) -> dict[str, dict[str, int]]:
    """Return the values that the records beside files give for each kind of fact, with the number of files of each."""
    facts: dict[str, Counter] = {}
    for path in files:
        record_path = path.with_name(path.name + ".provenance.json")
        values = {"Code": "not recorded"}
        if record_path.is_file():
            record = json.loads(record_path.read_text(encoding="utf-8"))
            commit = record["code"]["commit"] or "outside a git checkout"
            values = {
                "Code": f"{commit} with uncommitted changes" if record["code"]["dirty"] else commit,
                "Config (SHA-256)": _config(record["config_sha256"]),
                "Packages, environment.lock (SHA-256)": record["environment_lock_sha256"],
                "Device": _device(record["device"]),
                "Python": record["python"],
                **dict(sorted(record["libraries"].items())),
            }
        for fact, value in values.items():
            facts.setdefault(fact, Counter())[value] += 1
    return {fact: dict(counts.most_common()) for fact, counts in facts.items()}


def _config(sections: dict | None) -> str:
    """Return one hash for those of all sections, or "none" where the step was run by hand."""
    return sha256_of_settings(sections) if sections else "none"


def _device(device: dict) -> str:
    """Return the processor in words, with the level of instructions its libraries were held to, and the GPU."""
    kind = f"{device['vendor']}, family {device['family']}, model {device['model']}, {device['instructions']}"
    return ", ".join(filter(None, [f"{device['name']} ({kind})", device["gpu"]]))


def _provenance_files(folder: Path, run: Run) -> list[Path]:
    suffix = {"tables": "csv", "figures": "pdf"}
    files = [folder / f"{result.kind}/{result.name}.{suffix[result.kind]}" for result in run.results]
    return files + _files_of_samples(run)


def _files_of_samples(run: Run) -> list[Path]:
    of_sources = [*run.samples.values(), *run.causes.values()]
    return [Path(path) for files in of_sources for path in files.values()]


def _samples(run: Run) -> list[dict]:
    """Return the registrations that the page shows in 3-D, those with measured causes last."""
    icp = run.config.get("registrations", {}).get("icp", {})
    settings = CauseSettings.from_dict(dict(run.config["causes"]), icp)
    reach = ICPSettings(**icp).correspondence_distance
    shown = [
        sample
        for source, files in run.samples.items()
        for sample in samples.page_samples(files, run.sources[source], settings.limits, reach)
    ]
    return shown + [
        sample
        for source, files in run.causes.items()
        for sample in cause_samples.cause_samples(files, run.sources[source], settings)
    ]


def _content(folder: Path, result: Shown, run: Run, links: Links) -> dict:
    """Return one table or figure as the template takes it."""
    from PIL import Image

    caption = links.in_html(rendered_caption(result.name, result.caption), result.name)
    common = {"name": result.name, "title": _named(result.title, run.sources), "caption": caption}
    if result.kind == "tables":
        printed = json.loads((folder / f"tables/{result.name}.json").read_text(encoding="utf-8"))
        return common | {"table": in_groups(printed)}
    with Image.open(folder / f"figures/{result.name}.png") as image:
        width, height = image.size
    return common | {"table": None, "width": round(width * _CSS_PIXELS), "height": round(height * _CSS_PIXELS)}


def _named(title: str, sources: Mapping[str, Mapping]) -> str:
    """Return a title that ends in the name of a source with what readers call it."""
    words, _, name = title.rpartition(": ")
    return f"{words}: {sources[name]['title']}" if words and name in sources else title


def rendered_caption(name: str, caption: str):
    """Return a caption, reStructuredText, as safe HTML.

    Raises:
        InputError: a fault in the caption of that table or figure.
    """
    from docutils.core import publish_parts
    from docutils.utils import SystemMessage
    from markupsafe import Markup

    # Nothing of its own gets into the page, neither files nor raw HTML; a fault stops instead of being printed.
    settings = {"raw_enabled": False, "file_insertion_enabled": False, "halt_level": 2, "report_level": 5}
    try:
        return Markup(publish_parts(caption, writer="html5", settings_overrides=settings)["body"])
    except SystemMessage as fault:
        raise InputError(f"caption of {name}", f"is not valid reStructuredText ({fault})", "correct it") from fault
