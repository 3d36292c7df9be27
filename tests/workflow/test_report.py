"""The page that the smoke run ends with, and Snakemake's report of it; neither asks for the network."""

import json
import re

import pytest

from gpca.declarations.registry import registered
from gpca.page.crate import NAME

from ..page.test_crate import faults

ENTRIES = {
    entry.name: entry
    for each in registered()
    for entry in ([each.of_source(name) for name in ("coffee_cup", "ycb")] if "{source}" in each.name else [each])
}


def shown_in(folder):
    """Names of the tables and figures of a run's folder."""
    return {path.stem for path in (*folder.glob("tables/*.csv"), *folder.glob("figures/*.png"))}


@pytest.fixture(scope="module")
def report(smoke, tmp_path_factory):
    """What the report of the smoke run says of each file, and its categories."""
    project = smoke.copy(tmp_path_factory.mktemp("report") / "finished")
    report = ("--report", "results/smoke/report.html", "--report-after-run")
    done = project.snakemake("-j1", "all", "--configfile", "config/smoke.yaml", *report)
    assert "Missing metadata" not in done.stderr
    return read_report(project.folder / "results/smoke/report.html")


def read_report(path):
    text = path.read_text(encoding="utf-8")
    starts = [text.index("{", text.index(f'<script id="{name}">')) for name in ("results", "categories")]
    return [json.JSONDecoder().raw_decode(text, start)[0] for start in starts]


def test_the_report_holds_every_table_and_figure_with_title_and_caption(report, smoke):
    results, _ = report
    of_name = {re.sub(r"\.\w+$", "", entry["name"]): entry for entry in results.values()}
    assert of_name.keys() == shown_in(smoke.folder / "results/smoke")
    for name, entry in of_name.items():
        assert entry["labels"] == {"result": ENTRIES[name].title}
        assert entry["caption"].startswith("<p>")
        assert entry["data_uri"].startswith("data:")


def test_the_report_is_ordered_by_the_papers_sections(report):
    results, categories = report
    for section, entries in categories.items():
        for path in (path for paths in entries.values() for path in paths):
            assert ENTRIES[re.sub(r"\.\w+$", "", results[path]["name"])].section == section


def test_the_page_holds_every_table_and_figure_of_the_run(smoke):
    folder = smoke.folder / "results/smoke"
    text = (folder / "index.html").read_text()
    assert set(re.findall(r'<article id="([^"]+)">', text)) == shown_in(folder)
    assert "procedural stand-in" in text
    assert (folder / "index.html").stat().st_size < 2e6
    assert '"shares":' in text  # failures whose causes were measured


def test_the_crate_of_the_run_names_every_result_with_a_record(smoke):
    folder = smoke.folder / "results/smoke"
    crate = json.loads((folder / NAME).read_text())
    assert faults(crate, folder) == []
    parts = {entity["@id"].rstrip("/") for entity in crate["@graph"] if entity["@type"] in ("File", "Dataset")}
    recorded = {str(path.relative_to(folder)) for path in folder.rglob("*.provenance.json")}
    # The records of the job that wrote the crate come after it.
    own = {"index.html", NAME}
    assert parts - {"."} == {name.removesuffix(".provenance.json") for name in recorded} - own
