import re
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb

from gpca.process.code_files import code_files
from gpca.reporting.figures import style


def test_the_palette_is_that_of_the_file_and_a_users_own_settings_change_nothing():
    style.use_style()
    ours = dict(matplotlib.rcParams)
    matplotlib.rcParams.update({"font.size": 20, "axes.facecolor": "red", "lines.linestyle": "--"})
    style.use_style()
    assert dict(matplotlib.rcParams) == ours
    style.use_style()
    cycle = [f"#{color.lstrip('#')}" for color in matplotlib.rcParams["axes.prop_cycle"].by_key()["color"]]
    assert tuple(cycle) == style.PALETTE
    assert matplotlib.rcParams["figure.figsize"][0] == style.COLUMN_WIDTH_IN
    assert matplotlib.rcParams["xtick.labelsize"] == style.SMALL_PT
    import matplotlib.pyplot as plt

    matplotlib.rcdefaults()
    with plt.style.context(style.MATPLOTLIBRC):
        assert matplotlib.rcParams["font.family"] == ["STIXGeneral"]
    style.use_style()


def test_letters_are_truetype_and_nothing_is_dated(tmp_path):
    style.use_style()
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots()
    axes.plot([0, 1], [1, 0])
    axes.set_title("Fits $\\sigma$")
    style.save_figure(figure, tmp_path / "a.pdf", tmp_path / "a.png")
    pdf, png = (tmp_path / "a.pdf").read_bytes(), (tmp_path / "a.png").read_bytes()
    assert b"/TrueType" in pdf or b"/CIDFontType2" in pdf
    assert b"/Type3" not in pdf
    assert b"Date" not in pdf and b"Matplotlib" not in pdf
    assert b"Software" not in png and b"tIME" not in png


def test_colors_are_named_in_the_style_alone_and_an_edit_of_the_file_redraws_every_figure():
    assert "gpca/reporting/figures/matplotlibrc" in code_files("gpca.experiments.kernel_grid")
    assert "gpca/reporting/figures/matplotlibrc" not in code_files("gpca.classifier.gpc")
    folder = Path(style.__file__).parent
    strangers = {
        path.name: found
        for path in folder.glob("*.py")
        if path.name != "style.py" and (found := re.findall(r"#[0-9A-Fa-f]{6}", path.read_text(encoding="utf-8")))
    }
    assert not strangers


def test_what_is_drawn_over_each_other_differs_in_gray():
    def gray(color):
        return float(np.dot(to_rgb(color), (0.299, 0.587, 0.114)))

    shares = [gray(style.blues()(share)) for share in (0.0, 0.5, 1.0)]
    assert shares[0] > shares[1] + 0.1 > shares[2] + 0.2
    assert len(set(style.CONCEPT_COLORS.values())) == len(set(style.CONCEPT_MARKERS.values())) == 3
    assert abs(gray(style.TARGET_COLOR) - gray(style.SOURCE_COLOR)) > 0.05
