"""Writes a run as one web page that works from disk: findings, comparison, tables, figures, registrations."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.io.files import write_text
from gpca.jobs.provenance import DEVICE, read_record, sha256_of_settings
from gpca.model.scene import ASSETS
from gpca.page.comparison import page_comparison
from gpca.page.findings import Titles, findings_of
from gpca.page.samples import POINTS, RULE, cause_samples

TEMPLATES = Path(__file__).parent / "templates"
KEY_FIGURES = ("causes_example", "fig2_overview")  # the first of these that the run has opens the page
VERDICTS = "verdicts"  # the figure above the comparison
# What stands below the comparison with the paper, and in the groups after it: title -> names, whatever their section.
PAPER = (
    *("table1_single_baselines", "table2_per_concept", "table3_active_learning", "table4_kernels", "table5_compact"),
    *("table6_backbones", "table7_runtime", "claims"),
)
GROUPS = {
    "Causes": ("table9_causes", "failures", "loophole", "table10_controls", "table9_shift", "guarantee"),
    "Scans": ("table18_scan_causes", "scan_failures", "table17_scans", "table9_frames", "fig5_real_world_example"),
    "Repair and recovery": ("table20_repair", "table11_registration", "table8_recovery"),
}
DOCS = "../../docs"  # from the folder of a run in a checkout, results/{run}
FEWEST = 2  # mean number of rows with the same first label from which they form a group
_CSS_PIXELS = 170 / 300  # CSS pixels of a figure's pixel at 300 dpi, so that its letters are as large as the text's
_NAMES = re.compile(  # links and tags stay as they are
    r"<a\b.*?</a>|<[^>]*>|docs/(?P<page>[a-z_]+\.md)|(?P<word>\w+(?:\.csv)?)\b", re.DOTALL
)


@dataclass(frozen=True)
class Shown:
    """A table or figure; the attributes are those of :class:`gpca.reporting.registry.Result`."""

    name: str
    kind: str
    section: str
    title: str
    caption: str


@dataclass(frozen=True)
class FinishedRun:
    """A run with what its page needs besides its results."""

    name: str
    seeds: Sequence[int]  # of its repeats
    sources: Mapping[str, Mapping]  # name -> ``{"title": str, "stand_in": bool}``
    results: Sequence[Shown]  # tables and figures, in order
    causes: Mapping[str, Mapping[str, str]]  # source -> files for :func:`cause_samples`
    titles: Titles  # of the explainers
    config: Mapping  # the whole configuration


def write_page(folder: str | Path, run: FinishedRun) -> None:
    """Write ``index.html`` of a finished run into its folder ``results/{run}``."""
    folder = Path(folder)
    sample_files = [Path(path) for files in run.causes.values() for path in files.values()]
    shown = {result.name: result for result in run.results}
    links = Links(folder, shown)
    content = {name: _content(folder, result, run, links) for name, result in shown.items()}
    groups = {title: [content[name] for name in names if name in content] for title, names in GROUPS.items()}
    grouped = {*PAPER, *(name for names in GROUPS.values() for name in names)}
    sections: dict[str, list[dict]] = {}
    for result in run.results:
        if result.name not in grouped:
            sections.setdefault(result.section, []).append(content[result.name])
    key_figure = next((shown[name] for name in KEY_FIGURES if name in shown), None)
    suffix = {"tables": "csv", "figures": "pdf"}
    recorded = [folder / f"{result.kind}/{result.name}.{suffix[result.kind]}" for result in run.results]
    settings = CauseSettings.from_dict(dict(run.config["causes"]), run.config.get("registrations", {}).get("icp", {}))
    samples = [
        sample for source, files in run.causes.items() for sample in cause_samples(files, run.sources[source], settings)
    ]
    text = render(
        run=run,
        findings=findings_of(folder, run.titles, shown),
        key_figure=key_figure and content[key_figure.name],
        verdict_map=content.get(VERDICTS),
        paper=[content[name] for name in PAPER if name in content],
        groups={title: results for title, results in groups.items() if results},
        rest="Everything else",
        sections=sections,
        comparison=page_comparison(folder / "comparison.csv"),
        links=links,
        samples=samples,
        provenance=read_provenance(recorded + sample_files),
    )
    write_text(folder / "index.html", text)


def render(template: str = "index.html.jinja", **content) -> str:
    """Return a page's HTML; everything that comes from files is escaped."""
    import yaml
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    def short(section: str) -> str:  # for the menu
        words = section.removeprefix("Beyond the paper: ")
        return words[:1].upper() + words[1:]

    environment = Environment(
        loader=FileSystemLoader([TEMPLATES, ASSETS]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["anchor"] = lambda title: re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
    environment.filters["short"] = short
    environment.filters["yaml"] = lambda value: yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=100)
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "sort_keys": True}
    words = {"samples_rule": RULE, "samples_points": POINTS}
    return environment.get_template(template).render(**content, **words)


def read_provenance(files: Iterable[Path]) -> dict[str, dict[str, int]]:
    """Return the recorded values of each kind of fact about the files, with the number of files of each value."""
    facts: dict[str, Counter] = {}
    for path in files:
        values = {"Code": "not recorded"}
        if record := read_record(path):
            sections, device = record["config_sha256"], {name: record["device"].get(name) or "" for name in DEVICE}
            commit = record["code"].get("commit") or "outside a git checkout"
            kind = f"{device['vendor']}, family {device['family']}, model {device['model']}, {device['instructions']}"
            values = {
                "Code": f"{commit} with uncommitted changes" if record["code"].get("dirty") else commit,
                # One hash for all sections; a step run by hand has none.
                "Config (SHA-256)": sha256_of_settings(sections) if sections else "none",
                "Packages, environment.lock (SHA-256)": record["environment_lock_sha256"],
                "Device": ", ".join(filter(None, [f"{device['name']} ({kind})", device["gpu"]])),
                "Python": record["python"],
                **dict(sorted(record["libraries"].items())),
            }
        for fact, value in values.items():
            facts.setdefault(fact, Counter())[value] += 1
    return {fact: dict(counts.most_common()) for fact, counts in facts.items()}


def _content(folder: Path, result: Shown, run: FinishedRun, links: Links) -> dict:
    """Return one table or figure for the template."""
    from PIL import Image

    words, _, source = result.title.rpartition(": ")
    title = f"{words}: {run.sources[source]['title']}" if words and source in run.sources else result.title
    caption = links.in_html(rendered_caption(result.name, result.caption), result.name)
    common = {"name": result.name, "title": title, "caption": caption}
    if result.kind == "tables":
        printed = json.loads((folder / f"tables/{result.name}.json").read_text(encoding="utf-8"))
        part = printed.get("short", printed)
        return common | {"table": in_groups(part), "whole": in_groups(printed) if part is not printed else None}
    with Image.open(folder / f"figures/{result.name}.png") as image:
        width, height = image.size
    return common | {"table": None, "width": round(width * _CSS_PIXELS), "height": round(height * _CSS_PIXELS)}


def in_groups(printed: Mapping) -> dict:
    """Group consecutive rows with the same first label; all in one where groups would be small or labels come back."""
    rows, labels = printed["rows"], printed["label_columns"]
    runs = [(first, list(group)) for first, group in groupby(rows, key=lambda row: row[0][0])]
    if labels < 2 or len({first for first, _ in runs}) < len(runs) or len(rows) < FEWEST * len(runs):
        return dict(printed) | {"groups": [{"title": "", "rows": rows}]}
    head = printed["heads"][0]
    groups = [{"title": f"{head}: {first}", "rows": [row[1:] for row in group]} for first, group in runs]
    return dict(printed) | {"heads": printed["heads"][1:], "label_columns": labels - 1, "groups": groups}


def rendered_caption(name: str, caption: str):
    """Return a caption, reStructuredText, as safe HTML."""
    from docutils.core import publish_parts
    from docutils.utils import SystemMessage
    from markupsafe import Markup

    # No files and no raw HTML get into the page; a fault stops instead of being printed.
    settings = {"raw_enabled": False, "file_insertion_enabled": False, "halt_level": 2, "report_level": 5}
    try:
        return Markup(publish_parts(caption, writer="html5", settings_overrides=settings)["body"])
    except SystemMessage as fault:
        raise InputError(f"caption of {name}", f"is not valid reStructuredText ({fault})", "correct it") from fault


class Links:
    """Links the names in a text: pages of ``docs/``, CSV files of a run's folder, tables and figures on its page."""

    def __init__(self, folder: Path, results: Collection[str]) -> None:
        docs = folder / DOCS
        self._pages = {path.name for path in docs.glob("*.md")} if docs.is_dir() else set()
        self._files = {path.name for path in folder.glob("*.csv")}
        self._results = {name for name in results if "_" in name}  # the others are ordinary words too

    def in_text(self, text: str, without: str = ""):
        """Return a text as HTML: escaped, with backticks as code, and with links, but to the table `without`."""
        from markupsafe import Markup, escape

        parts = str(escape(text)).split("`")
        html = "".join(f"<code>{part}</code>" if k % 2 else part for k, part in enumerate(parts))
        return self.in_html(Markup(html), without)

    def in_html(self, html, without: str = ""):
        """Return HTML with links; ``without`` is as in :meth:`in_text`."""
        from markupsafe import Markup

        def linked(match: re.Match) -> str:
            page, word = match["page"], match["word"]
            if page in self._pages:
                return f'<a href="{DOCS}/{page}">docs/{page}</a>'
            if word in self._files:
                return f'<a href="{word}">{word}</a>'
            return f'<a href="#{word}">{word}</a>' if word in self._results and word != without else match[0]

        return Markup(_NAMES.sub(linked, str(html)))
