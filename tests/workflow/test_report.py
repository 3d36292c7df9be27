"""The page that the smoke run ends with, and Snakemake's report of it; neither asks for the network."""

import json
import re

import pytest

from gpca.reporting.sections import OTHER, SECTIONS, section_of, title_of_result

from .conftest import ROOT


def shown_in(folder):
    """Names of the tables and figures of a run's folder."""
    return {path.stem for path in (*folder.glob("tables/*.csv"), *folder.glob("figures/*.png"))}


@pytest.fixture(scope="module")
def report(smoke, tmp_path_factory):
    """What the report of the smoke run says of each file, and its categories."""
    project = smoke.copy(tmp_path_factory.mktemp("report") / "finished")
    project.snakemake("-j1", "report", "--configfile", "config/smoke.yaml")
    log = (project.folder / "results/smoke/logs/report.log").read_text()
    assert "Missing metadata" not in log
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
        assert entry["labels"] == {"result": title_of_result(name)}
        assert entry["caption"].startswith("<p>")
        assert entry["data_uri"].startswith("data:")


def test_the_report_is_ordered_by_the_papers_sections(report):
    results, categories = report
    assert set(categories) <= set(SECTIONS)
    for section, entries in categories.items():
        for path in (path for paths in entries.values() for path in paths):
            assert section_of(re.sub(r"\.\w+$", "", results[path]["name"])) == section


def test_the_page_holds_every_table_and_figure_of_the_run(smoke):
    folder = smoke.folder / "results/smoke"
    text = (folder / "index.html").read_text()
    assert set(re.findall(r'<article id="([^"]+)">', text)) == shown_in(folder)
    assert "procedural stand-in" in text
    assert (folder / "page/plotly.min.js").is_file()


@pytest.mark.parametrize(("config", "run"), [("config", "embedded"), ("real", "real")])
def test_every_table_and_figure_is_listed_and_captioned(project, config, run):
    planned = project.dry_run(f"results/{run}/index.html", "--configfile", f"config/{config}.yaml")
    names = {re.sub(r".*/|\.\w+$", "", path) for path in planned.outputs if re.search("/(tables|figures)/", path)}
    assert len(names) > 20
    assert [name for name in names if section_of(name) == OTHER] == []
    captions = {path.stem for path in (ROOT / "workflow/report").glob("*.rst")}
    assert {name.split("objects_")[0] or "objects" for name in names} <= captions
