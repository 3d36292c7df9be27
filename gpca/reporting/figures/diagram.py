"""Draws diagrams whose parts are panels of data, on a canvas measured in inches, with boxes and arrows of one look."""

from typing import Any

from gpca.reporting.figures.style import GRAY, SMALL_PT, use_style


class Canvas:
    """A figure in the suite's style, whose frameless axes have inches from the lower left corner as coordinates."""

    def __init__(self, width_in: float, height_in: float) -> None:
        self.width_in, self.height_in = width_in, height_in
        self.figure = use_style().figure(figsize=(width_in, height_in))
        self.axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, width_in), ylim=(0, height_in))
        self.axes.set_axis_off()

    def panel(self, left_in: float, bottom_in: float, width_in: float, height_in: float):
        """Return new axes at this place, through which boxes are seen."""
        left, width = left_in / self.width_in, width_in / self.width_in
        bottom, height = bottom_in / self.height_in, height_in / self.height_in
        axes = self.figure.add_axes((left, bottom, width, height))
        axes.patch.set_visible(False)
        return axes

    def text(self, x_in: float, y_in: float, words: str, **style) -> None:
        """Write at this place, centered unless the style says otherwise."""
        look: dict[str, Any] = {"ha": "center", "fontsize": SMALL_PT, "linespacing": 1.15} | style
        self.axes.text(x_in, y_in, words, **look)

    def dot(self, x_in: float, y_in: float, color: str, words: str, gap_in: float = 0.06) -> None:
        """Draw a dot of a cloud's color at this place, with the cloud's name to its right."""
        self.axes.plot(x_in, y_in + 0.005, "o", color=color, markersize=3)
        self.text(x_in + gap_in, y_in, words, ha="left", va="center")

    def box(
        self,
        left_in: float,
        bottom_in: float,
        width_in: float,
        height_in: float,
        words: str = "",
        color: str = GRAY,
        dashed: bool = False,
    ) -> None:
        """Draw a rounded box, tinted by its color, with words in the middle; a dashed one is white."""
        from matplotlib.patches import FancyBboxPatch

        look: dict[str, Any] = {"facecolor": "white", "linestyle": "--"} if dashed else {"facecolor": color + "22"}
        style = f"round,pad=0,rounding_size={min(0.06, height_in / 3)}"
        corner = (left_in, bottom_in)
        self.axes.add_patch(
            FancyBboxPatch(corner, width_in, height_in, boxstyle=style, edgecolor=color, linewidth=0.9, **look)
        )
        self.text(left_in + width_in / 2, bottom_in + height_in / 2, words, va="center")

    def arrow(self, *points_in: tuple[float, float], color: str = GRAY, words: str = "") -> None:
        """Draw a line through points (x, y) with a head at the last; words stand over the middle of its start."""
        if len(points_in) > 2:
            corners = {"solid_capstyle": "butt", "solid_joinstyle": "miter"}
            self.axes.plot(*zip(*points_in[:-1], strict=True), color=color, linewidth=0.9, **corners)
        look = {"arrowstyle": "-|>", "color": color, "lw": 0.9, "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", points_in[-1], points_in[-2], arrowprops=look)
        if words:
            (x, y), (x_end, _) = points_in[:2]
            self.text((x + x_end) / 2, y + 0.035, words, va="bottom")
