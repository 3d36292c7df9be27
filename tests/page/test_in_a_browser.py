"""The page in a real browser."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from gpca.page.page import write_page

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_a_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: install it to test the page in a browser")

# Notes on speed that a software renderer gives.
SPEED = ("Canvas2D: Multiple readback", "GL Driver Message")
# What a reader does: hide a verdict, choose a table; look at the last sample in its initial pose.
READER = """<script>
addEventListener("load", () => {
  document.querySelector('#verdict-filters [data-verdict="close"]').click();
  const table = document.getElementById("table-filter");
  table.value = "I";
  table.dispatchEvent(new Event("change"));
  document.querySelector('[data-pose="initial"]').click();
  const sample = document.getElementById("sample");
  sample.value = "5";
  sample.dispatchEvent(new Event("change"));
});
</script></body>"""


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
def test_a_browser_draws_both_clouds_and_has_nothing_to_complain_about(folder, tmp_path):
    from PIL import Image

    chromium(folder / "index.html", tmp_path, f"--screenshot={tmp_path / 'page.png'}", "--window-size=1000,5000")
    with Image.open(tmp_path / "page.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    for color in ((213, 94, 0), (0, 114, 178)):  # of target and source
        of_color = (np.abs(pixels - color).max(axis=2) < 12).sum(axis=1)
        assert (of_color > 0).sum() > 100  # rows of pixels: a cloud, not the key below it


@in_a_browser
def test_verdicts_tables_samples_and_poses_can_be_chosen(copied, tmp_path):
    folder, run = copied
    write_page(folder, run)
    driven = folder / "driven.html"
    driven.write_text((folder / "index.html").read_text().replace("</body>", READER))
    shown = chromium(driven, tmp_path, "--dump-dom", "--window-size=400,800")
    assert 'data-shown="5 initial"' in shown
    assert "WebGL is not supported" not in shown
    assert re.search(r'<div id="clouds"[^>]*>.*<canvas', shown, flags=re.DOTALL)
    assert "1 of 4 numbers" in shown
    assert re.findall(r'<tr data-verdict="([^"]*)" data-table="[^"]*">', shown) == ["reproduced"]
    assert "True cause: overlap" in shown


@in_a_browser
def test_without_its_script_the_view_says_what_is_missing(copied, tmp_path):
    folder, run = copied
    write_page(folder, run)
    alone = tmp_path / "index.html"
    alone.write_text(re.sub(r'<script src="[^"]*" defer></script>', "", (folder / "index.html").read_text()))
    assert "needs page/plotly.min.js beside this page" in chromium(alone, tmp_path, "--dump-dom")
