"""Tables of the page: what rows share is said once, and names become links."""

from gpca.page.links import Links
from gpca.page.tables import in_groups


def printed(*labels):
    rows = [[*([label, False] for label in row), ["97.7", True]] for row in labels]
    heads = ["Dataset", "Explainer", "Reads"][: len(labels[0])]
    return {
        "caption": "",
        "heads": [*heads, "Accuracy (%)"],
        "label_columns": len(heads),
        "rows": rows,
        "footnotes": [],
    }


def test_the_dataset_of_many_rows_stands_above_them_once():
    table = in_groups(printed(("Cups", "SHAP"), ("Cups", "SA"), ("YCB", "SHAP"), ("YCB", "SA")))
    assert [group["title"] for group in table["groups"]] == ["Dataset: Cups", "Dataset: YCB"]
    assert table["heads"] == ["Explainer", "Accuracy (%)"]
    assert table["label_columns"] == 1
    assert table["groups"][1]["rows"][0] == [["SHAP", False], ["97.7", True]]


def test_rows_that_share_little_or_come_back_are_one_group():
    alone = printed(("Cups",), ("YCB",))
    few = printed(("Cups", "SHAP"), ("Cups", "SA"), ("YCB", "SHAP"))
    back = printed(("Cups", "SHAP"), ("Cups", "SA"), ("YCB", "SHAP"), ("YCB", "SA"), ("Cups", "All"), ("Cups", "None"))
    for table in (alone, few, back):
        assert in_groups(table) == table | {"groups": [{"title": "", "rows": table["rows"]}]}


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
