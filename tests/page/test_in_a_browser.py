"""The pages in a real browser."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from gpca.__main__ import main
from gpca.page.page import write_page

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_a_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: install it to test the page in a browser")

# Notes on speed that a software renderer gives.
SPEED = ("Canvas2D: Multiple readback", "GL Driver Message")
# What a reader does: hide a verdict, choose a table, look for a row and sort; look at the last sample in its initial
# pose. What was drawn is counted: points of the target are red, those of the source blue.
READER = """<script>
addEventListener("load", () => {
  document.querySelector('#verdict-filters [data-verdict="close"]').click();
  const table = document.getElementById("table-filter");
  table.value = "I";
  table.dispatchEvent(new Event("change"));
  for (let click = 0; click < 2; click += 1) document.querySelector("#table2_per_concept thead th button").click();
  document.querySelector('[data-view="start"]').click();
  const sample = document.getElementById("sample");
  sample.value = sample.options.length - 1;
  sample.dispatchEvent(new Event("change"));
  setTimeout(() => {
    const view = document.getElementById("view");
    const { data } = view.getContext("2d").getImageData(0, 0, view.width, view.height);
    let [red, blue] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
      red += data[i] > data[i + 2] + 60;
      blue += data[i + 2] > data[i] + 60;
    }
    document.body.dataset.drawn = `${red > 200} ${blue > 200}`;
    document.body.dataset.menu = document.querySelector("nav").offsetHeight
      < parseFloat(getComputedStyle(document.documentElement).scrollPaddingTop);
    document.body.dataset.wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  }, 500);
});
</script>"""
SEARCHED = """<script>
addEventListener("load", () => {
  const search = document.querySelector('input[type="search"]');
  search.value = "row 3";
  search.dispatchEvent(new Event("input"));
});
</script>"""


def with_script(page, script):
    """A page that runs one more script when it has loaded.

    Frames are timers, which virtual time waits for: real frames come too late on a busy machine.
    """
    frames = "<script>window.requestAnimationFrame = (draw) => setTimeout(draw, 0);</script>"
    for mark, added in (("<head>", f"<head>{frames}"), ("</body>", f"{script}</body>")):
        assert page.count(mark) == 1
        page = page.replace(mark, added)
    return page


def chromium(path, profile, *options):
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader"]
    command += ["--enable-unsafe-swiftshader", f"--user-data-dir={profile}", "--virtual-time-budget=10000"]
    command += ["--hide-scrollbars", "--enable-logging=stderr", "--v=0", *options, path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    said = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    assert [line for line in said if not any(note in line for note in SPEED)] == []
    return done.stdout


@in_a_browser
def test_verdicts_tables_samples_and_poses_can_be_chosen(copied, tmp_path):
    folder, run = copied
    write_page(folder, run)
    driven = folder / "driven.html"
    driven.write_text(with_script((folder / "index.html").read_text(), READER))
    shown = chromium(driven, tmp_path, "--dump-dom", "--window-size=400,800")
    assert re.search(r'data-shown="\d"', shown) and 'data-shown="start"' in shown
    assert "1 of 4 numbers" in shown
    assert re.findall(r'<tr data-verdict="([^"]*)" data-table="[^"]*">', shown) == ["reproduced"]
    assert "What each cause adds to the error" in shown
    assert "Before the registration: the median distance to the target is" in shown
    assert 'data-drawn="true true"' in shown
    assert 'data-menu="true"' in shown and 'data-wide="false"' in shown
    # Sorted by the names, the last first; other tables keep their order.
    tables = {name: re.findall(r'<th scope="row">([^<]*)<', part) for name, part in articles(shown).items()}
    assert tables["table2_per_concept"] == ["Cones", "Bricks"]
    assert tables["table1_single_baselines"] == ["Bricks", "Cones"]
    assert 'aria-sort="descending"' in articles(shown)["table2_per_concept"]
    assert 'data-kept="1"' in articles(shown)["table2_per_concept"]


def articles(text):
    """The HTML of every table and figure, by name."""
    return dict(re.findall(r'<article id="([^"]+)">(.*?)</article>', text, flags=re.DOTALL))


@in_a_browser
def test_two_runs_show_what_differs_and_can_be_searched(two_runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["compare", *map(str, two_runs), "--out", "compare.html"]) == 0
    page = Path("compare.html")
    page.write_text(with_script(page.read_text(), SEARCHED))
    shown = chromium(page.resolve(), tmp_path / "profile", "--dump-dom", "--window-size=820,800")
    rows = re.findall(r'<tr(?: class="([^"]*)")?[^>]*><th scope="row">(row \d+)', articles(shown)["table9_long"])
    assert [name for kinds, name in rows if "alike" not in kinds and "unfound" not in kinds] == ["row 3"]
    assert re.search(r'<tr class="alike[^"]*" hidden', shown)
