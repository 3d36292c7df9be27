"""The page of a small folder of results: its HTML by a parser, and what is refused."""

import json
import re

import pytest

from gpca.errors import InputError
from gpca.io.files import whole_file
from gpca.page.page import Links, in_groups, read_provenance, write_page
from gpca.process.processor import describe
from tests.accessible import faults_of
from tests.page.small_run import FIGURES, TABLES, Page, results, run_of


def test_every_link_leads_to_a_file_or_a_place_on_the_page(page, folder):
    assert page.stack == []
    local = [link for link in page.links if not link.startswith("data:,")]
    assert len(local) > 15
    assert [link for link in local if link.startswith("#") and link[1:] not in page.ids] == []
    assert [link for link in local if not link.startswith("#") and not (folder / link).is_file()] == []
    assert [source for source in page.sources if not (folder / source).is_file()] == []
    assert len(set(page.ids)) == len(page.ids)
    assert re.findall(r"(?:https?:)?//[\w-]+\.[\w.-]+", page.text) == []  # nothing is loaded from elsewhere


def test_the_page_can_be_read_by_ear_and_by_keyboard(page):
    assert faults_of(page.text) == []
    broken = page.text.replace('<html lang="en">', "<html>").replace('scope="col"', "", 1).replace("<h3>", "<h4>", 1)
    assert len(faults_of(broken)) >= 3


def test_every_table_and_figure_is_shown_with_its_caption_in_the_papers_order(page):
    shown = [name for name in page.ids if name in (*TABLES, *FIGURES)]
    assert shown == [TABLES[1], TABLES[0], "objects_bricks", *TABLES[2:], "reliability"]
    for name in shown:
        assert f"Title of {name}" in page.text
        assert f'What <span class="docutils literal">{name}</span> shows.' in page.text
    assert page.text.count("<td><b>97.7 ± 0.4</b></td>") == len(TABLES)
    assert page.text.count("<td>33.3 ± 2.0</td>") == len(TABLES)
    assert page.text.count("A footnote.") == len(TABLES)


def test_the_page_opens_with_what_was_found_and_ends_with_where_it_comes_from(page):
    order = ["answer", "findings", "registrations", "comparison", "everything-else", "objects_bricks", "provenance"]
    assert [name for name in page.ids if name in order] == order
    assert "<dt>75 to 90 %</dt><dd>Under the paper's protocol" in page.text.replace("&#39;", "'")
    folded = page.text.rindex("<details>")
    assert page.text.index('id="provenance"') < folded < page.text.index("SHA-256") < page.text.rindex("</details>")
    assert page.text.count("SHA-256") == page.text[folded:].count("SHA-256")


def test_a_large_table_is_shown_in_part_and_whole_behind_a_click(copied):
    folder, run = copied
    path = folder / "tables/table4_mine.json"
    whole = json.loads(path.read_text())
    path.write_text(json.dumps(whole | {"short": whole | {"rows": whole["rows"][:1], "left_out": "1 of 2 rows."}}))
    write_page(folder, run)
    text = (folder / "index.html").read_text()
    part, folded = text.split('<article id="table4_mine">')[1].split("</article>")[0].split('<details class="whole">')
    assert "1 of 2 rows. All of it here:" in folded
    assert (part.count('<th scope="row">'), folded.count('<th scope="row">')) == (1, len(whole["rows"]))


def test_the_comparison_comes_with_its_verdicts_counted_and_named(page):
    assert page.text.index('id="comparison"') < page.text.index('id="objects_bricks"')
    for verdict in ("reproduced", "close", "not reproduced", "not run"):
        assert re.search(rf'data-verdict="{verdict}" aria-pressed="true"><b>1</b> {verdict}<', page.text)
        assert re.search(rf'<span class="verdict[^"]*">{verdict}</span>', page.text)


def test_stand_ins_are_labeled_and_real_objects_are_not(page, copied):
    assert 'Bricks &lt;b&gt; <span class="badge">procedural stand-in</span>' in page.text
    assert "<li>Cones</li>" in page.text
    folder, _ = copied
    sources = {name: {"title": name, "stand_in": False} for name in ("bricks", "cones")}
    write_page(folder, run_of(folder, sources=sources))
    assert "stand-in</span>" not in (folder / "index.html").read_text()
    assert "stand-ins</strong>" not in (folder / "index.html").read_text()


def test_what_comes_from_files_cannot_become_markup(page):
    assert "Accuracy (%) of &lt;GP-CA&gt; &amp; co., by <code>gpca</code>" in page.text
    assert "alert(1)</script>" not in page.text.replace("&lt;", "<").split("<pre>")[0]
    assert "&lt;/script&gt;&lt;script&gt;alert(1)" in page.text
    [text] = re.findall(r'<script type="application/json" id="samples">(.*)</script>', page.text)
    samples = json.loads(text)
    assert samples and {sample["state"] for sample in samples} == {"failed"}
    assert {sample["source"]["title"] for sample in samples} == {"Bricks <b>"}


def test_the_same_results_give_the_same_bytes_and_not_many(folder, copied):
    copy, run = copied
    write_page(copy, run)
    assert (copy / "index.html").read_bytes() == (folder / "index.html").read_bytes()
    assert (folder / "index.html").stat().st_size < 1e6
    assert not (folder / "page").exists()


def test_pages_of_the_docs_are_links_where_they_are(copied):
    folder, _ = copied
    (folder / "../../docs").mkdir()
    (folder / "../../docs/protocol.md").write_text("")
    shown = results(
        {"reliability": "As docs/protocol.md says, not docs/none.md; see ``metrics.csv``, table4_mine and reliability."}
    )
    write_page(folder, run_of(folder, results=shown))
    text = (folder / "index.html").read_text()
    assert 'As <a href="../../docs/protocol.md">docs/protocol.md</a> says, not docs/none.md' in text
    assert '<a href="metrics.csv">metrics.csv</a>' in text
    assert '<a href="#table4_mine">table4_mine</a> and reliability.' in text
    assert [link for link in Page(text).links if link.startswith("..") and not (folder / link).is_file()] == []


def test_without_comparison_and_samples_there_is_no_word_of_them(copied):
    folder, _ = copied
    (folder / "comparison.csv").unlink()
    write_page(folder, run_of(folder, causes={}))
    page = Page((folder / "index.html").read_text())
    assert "comparison-table" not in page.ids
    assert "registrations" not in page.ids
    assert page.sources == ["figures/objects_bricks.png", "figures/reliability.png"]


def test_records_of_provenance_are_counted(tmp_path):
    record = {"code": {"commit": "abc", "dirty": True}, "config_sha256": None, "environment_lock_sha256": "1"}
    record |= {"device": describe() | {"gpu": "a GPU"}, "python": "3.11", "libraries": {"numpy": "2"}}
    for name in ("a.csv", "b.csv"):
        with whole_file(tmp_path / f"{name}.provenance.json") as partial:
            partial.write_text(json.dumps(record))
    facts = read_provenance([tmp_path / name for name in ("a.csv", "b.csv", "c.csv")])
    assert facts["Code"] == {"abc with uncommitted changes": 2, "not recorded": 1}
    assert facts["numpy"] == {"2": 2}
    [device] = set(facts["Device"]) - {"not recorded"}
    assert describe()["name"] in device
    assert device.endswith(", a GPU")


@pytest.mark.parametrize(
    ("damaged", "text", "fault"),
    [("tiny/comparison.csv", "", "is empty"), ("tiny/causes/four/seed100.npz", "PK", "is not a readable npz archive")],
)
def test_a_damaged_file_is_named(copied, damaged, text, fault):
    folder, run = copied
    (folder.parent / damaged).write_text(text)
    with pytest.raises(InputError, match=f"{re.escape(damaged)}: {fault}"):
        write_page(folder, run)
    assert not (folder / "index.html").exists()


@pytest.mark.parametrize("caption", [".. nonsense::", ".. raw:: html\n\n   <b>"])
def test_a_fault_in_a_caption_is_named(copied, caption):
    folder, _ = copied
    with pytest.raises(InputError, match="caption of reliability: is not valid reStructuredText"):
        write_page(folder, run_of(folder, results=results({"reliability": caption})))
    assert not (folder / "index.html").exists()


def printed(*labels):
    rows = [[*([label, False] for label in row), ["97.7", True]] for row in labels]
    heads = ["Dataset", "Explainer"][: len(labels[0])]
    return {"heads": [*heads, "Accuracy (%)"], "label_columns": len(heads), "rows": rows}


def test_the_dataset_of_many_rows_stands_above_them_once():
    table = in_groups(printed(("Cups", "SHAP"), ("Cups", "SA"), ("YCB", "SHAP"), ("YCB", "SA")))
    assert [group["title"] for group in table["groups"]] == ["Dataset: Cups", "Dataset: YCB"]
    assert table["heads"] == ["Explainer", "Accuracy (%)"]
    assert table["label_columns"] == 1
    assert table["groups"][1]["rows"][0] == [["SHAP", False], ["97.7", True]]


def test_texts_are_escaped_and_only_what_is_there_is_a_link(tmp_path):
    (tmp_path / "metrics.csv").write_text("")
    links = Links(tmp_path, ["table1_mine", "readings"])
    text = links.in_text("<b> `metrics.csv` of table1_mine, readings and docs/none.md", "")
    assert text == (
        '&lt;b&gt; <code><a href="metrics.csv">metrics.csv</a></code> of <a href="#table1_mine">table1_mine</a>, '
        "readings and docs/none.md"
    )
    assert links.in_text("table1_mine", "table1_mine") == "table1_mine"
    already = '<a href="x/table1_mine">table1_mine</a>'
    assert links.in_html(already) == already
