"""A small run whose page is tested, and that page read by a parser."""

from html.parser import HTMLParser

from gpca.page.findings import Titles
from gpca.page.page import FinishedRun, Shown
from tests.conftest import FEW_CAUSES

TABLES = ["table2_per_concept", "table1_single_baselines", "table4_mine"]
FIGURES = ["objects_bricks", "reliability"]
SECTIONS = {"IV-A Datasets": FIGURES[:1], "IV-B Accuracy": TABLES, "IV-D Ablations": FIGURES[1:]}


class Page(HTMLParser):
    """What a page refers to, by the kinds that the tests ask for."""

    def __init__(self, text):
        super().__init__()
        self.text, self.ids, self.links, self.sources, self.stack = text, [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.links += [attributes["href"]] if attributes.get("href") else []
        self.sources += [attributes["src"]] if "src" in attributes else []
        if tag not in ("meta", "link", "img", "br", "input"):
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag


def results(captions=()):
    """All tables and figures by section, with a caption of its own where one is given."""
    return [
        Shown(
            name=name,
            kind="tables" if name in TABLES else "figures",
            section=section,
            title=f"Title of {name}",
            caption=dict(captions).get(name, f"What ``{name}`` shows."),
        )
        for section, names in SECTIONS.items()
        for name in names
    ]


def run_of(folder, **changes):
    entries = {
        "name": "tiny",
        "seeds": [0, 7],
        "sources": {
            "bricks": {"title": "Bricks <b>", "stand_in": True},
            "cones": {"title": "Cones", "stand_in": False},
        },
        "results": results(),
        "causes": {"bricks": {"objects": folder / "objects/four.npz", "causes": folder / "causes/four/seed100.npz"}},
        "titles": Titles({"gpca": {"title": "GP-CA", "oracle": False}}, {}, {}, 3),
        "config": {
            "run": "tiny",
            "note": "</script><script>alert(1)</script>",
            "causes": {name: list(value) if name == "points" else value for name, value in FEW_CAUSES.items()},
        },
    }
    return FinishedRun(**entries | changes)
