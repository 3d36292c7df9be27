"""Gives every figure of the suite one look, and writes it in one way: the same drawing gives the same bytes."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from gpca.io.files import printable, whole_file

MATPLOTLIBRC = str(Path(__file__).with_name("matplotlibrc"))
COLUMN_WIDTH_IN, TEXT_WIDTH_IN = 3.5, 7.16  # one column of an IEEE paper, and both

# Okabe and Ito chose these colors ("Color Universal Design", 2008), which no common color blindness confuses.
BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
PALETTE = (BLUE, VERMILION, GREEN, ORANGE, SKY_BLUE, PURPLE, YELLOW, BLACK)
GRAY = "#666666"  # Lines, boxes and what has no name of its own are gray.
LIGHT_GRAY = "#CCCCCC"  # What lies behind is light gray.

# One thing has one color in every figure. Concepts have a marker too, which survives a print in gray.
TARGET_COLOR = VERMILION
SOURCE_COLOR = BLUE
CONCEPT_COLORS = {"noise": ORANGE, "pose": PURPLE, "overlap": GREEN}
CONCEPT_MARKERS = {"noise": "o", "pose": "s", "overlap": "^"}
SMALL_PT = 7  # No letters are smaller.
MOST_LEVELS = 2  # of 255 by which a palette may change a channel
UNDATED = dict.fromkeys(("CreationDate", "ModDate", "Producer", "Creator"))  # metadata of a PDF

# Where many methods share a panel, the paper's have a color, a line and a width, and all others are gray.
METHOD_LOOKS: dict[str, tuple[str, Any, float]] = {
    "gpca_paper": (BLUE, (0, (4, 2)), 1.8),
    "gpca": (BLUE, "-", 1.8),
    "gpca_matern": (SKY_BLUE, "-", 1.4),
    "learner_forest": (VERMILION, "-", 1.4),
    "learner_linear_svm": (ORANGE, "-", 1.4),
    "gpca_pair": (GREEN, "-", 1.8),
}
OTHER_LOOK = (LIGHT_GRAY, "-", 0.9)


def use_style() -> Any:
    """Set matplotlib to its defaults and `MATPLOTLIBRC`, whatever a user's file says, and return its ``pyplot``."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcdefaults()
    matplotlib.rc_file(MATPLOTLIBRC, use_default_template=False)
    from matplotlib import pyplot

    return pyplot


def write_title(figure, words: str) -> None:
    """Write a figure's title where all have it: at the top left, in one line or more."""
    height_in = figure.get_size_inches()[1]
    # A layout that is worked out by itself leaves room for a title that has no place of its own.
    place = {} if figure.get_layout_engine() else {"y": 1 - 0.02 / height_in}
    figure.suptitle(printable(words), parse_math=False, x=0.005, ha="left", va="top", linespacing=1.15, **place)


def blues():
    """Return the color map of shares and densities: white to the palette's blue, dark in gray too."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("blues", ["white", BLUE])


def save_figure(figure, pdf_path: str | Path, png_path: str | Path) -> None:
    """Write `figure` as vector PDF and as 300 dpi PNG, both without date or version, then close it."""
    with whole_file(pdf_path) as partial:
        figure.savefig(partial, format="pdf", metadata=UNDATED)
    save_png(figure, png_path)


def save_png(figure, png_path: str | Path, dpi: int = 300) -> None:
    """Write `figure` as PNG alone, then close it: in 256 colors if they show it, for a quarter of the bytes."""
    import matplotlib.pyplot as plt
    from PIL import Image, ImageChops

    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi)
    plt.close(figure)
    image = Image.open(drawn).convert("RGB")
    few = image.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    # Two equal colors stay equal: a channel changes by no more than rounding does.
    largest = np.asarray(ImageChops.difference(image, few.convert("RGB"))).max()
    with whole_file(png_path) as partial:
        (few if largest <= MOST_LEVELS else image).save(partial, format="png", optimize=True, dpi=(dpi, dpi))
