"""Draws a contact sheet: every object of one source as a shaded solid, so that the eye can check the data."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.objects.canonical import ObjectClouds
from gpca.reporting.figures.cloud_views import view_from
from gpca.reporting.figures.panels import write_below
from gpca.reporting.figures.solid import Solid
from gpca.reporting.figures.style import TEXT_WIDTH_IN, use_style, write_title
from gpca.reporting.words import object_in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIEW = view_from(math.radians(-55), math.radians(32))  # The eye sees front, right and top.


def draw_contact_sheet(objects_npz: str | Path, title: str, dataset: str = "") -> Figure:
    """Draw all objects of one source (as `gpca objects` writes them) in tiles, with name and diameter below."""
    objects = ObjectClouds.load(objects_npz)
    count = len(objects)
    # The fewest tiles are empty, of √n to 1.7 √n columns (4 at least), the most columns of equals.
    widest = max(4, math.floor(1.7 * math.sqrt(count)))
    choices = range(widest, max(4, math.ceil(math.sqrt(count))) - 1, -1)
    columns = min(choices, key=lambda columns: -count % columns)
    rows = math.ceil(count / columns)
    tile_in = TEXT_WIDTH_IN / columns
    size_pt = min(7.0, max(4.5, 7.0 * tile_in))
    letters = max(4, int(0.96 * tile_in * 72 / (0.5 * size_pt)))  # in a line; half as wide as high
    captions = ["\n".join(textwrap.wrap(object_in_words(name, dataset), letters)) for name in objects.names]
    caption_in = size_pt * 1.2 / 72 * (max(caption.count("\n") for caption in captions) + 2) + 0.08
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, 0.36 + rows * (tile_in + caption_in)), layout="constrained")
    figure.get_layout_engine().set(w_pad=0, h_pad=0.02, wspace=0, hspace=0)
    write_title(figure, title)
    grid = figure.add_gridspec(rows, 2 * columns)  # Half tiles, so that a short last row can stand in the middle.
    for index, (name_lines, diameter_m) in enumerate(zip(captions, objects.diameters_m, strict=True)):
        row, column = divmod(index, columns)
        first = 2 * column + columns - min(columns, count - row * columns)
        panel = figure.add_subplot(grid[row, first : first + 2])
        solid = Solid.of(objects.points(index), objects.normals_of(index), VIEW, round(tile_in * 300))
        panel.imshow(solid.image, interpolation="antialiased")
        panel.set_axis_off()
        write_below(panel, f"{name_lines}\n{diameter_m * 1000:.0f} mm", fontsize=size_pt, pad=-2)
    return figure
