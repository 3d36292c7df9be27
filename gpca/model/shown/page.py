"""The page of an explanation: one file that needs no other and no network."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape

from gpca.model.advice import CHECK
from gpca.model.reenacted import Reenacted
from gpca.model.scene import Scene
from gpca.model.shown import parts
from gpca.model.shown.packing import ASSETS, packed_scene

# A browser then refuses whatever this page might ask of a network.
ALONE = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
FRAME_HEIGHT = 900  # pixels of the frame in a notebook
SHOW = 'openView().load(JSON.parse(document.getElementById("scene").textContent));\n'


def page(
    explained: Mapping,
    advice: str,
    reenacted: Reenacted | None,
    scene: Scene | None,
    names: Mapping[str, str] | None = None,
) -> str:
    """Return the HTML of one explanation.

    Args:
        explained: :meth:`gpca.model.explanation.Explanation.as_dict`.
        advice: what to do, in words.
        reenacted: what the re-enactment says; None where there was none.
        scene: what to draw; None leaves the view out.
        names: of the files and the model, as the page shows them.
    """
    unit = explained["unit"]
    possibilities = scene.possibilities if scene is not None else ()
    diameter = scene.frame.diameter if scene is not None else 1.0
    errors = [[diameter * what_if.error for what_if in each.what_ifs] for each in possibilities if each.what_ifs]
    unknown = explained["action"] == CHECK
    body = [
        parts.action(explained, advice),
        *([] if unknown else [parts.promise(explained), parts.causes(explained)]),
        _poses(reenacted, unit) if possibilities and reenacted else "",
        parts.counterfactuals(errors, diameter * (scene.limit if scene else 0), unit),
        "" if unknown else parts.as_in_the_paper(explained),
        parts.details(explained, names or {}),
    ]
    head = parts.headline(explained) + parts.warnings(explained["warnings"])
    data = None if scene is None else packed_scene(scene, unit)
    return assembled("Registration explained", head, body, data)


def _poses(reenacted: Reenacted, unit: str) -> str:
    words = [f"the object {each}" for each in reenacted.words(unit)]
    return parts.poses(words, reenacted.poses, parts.measured(reenacted, unit))


def assembled(title: str, head: str, body: Sequence[str], data: Mapping | None) -> str:
    """Return the whole page around its parts.

    Args:
        head: what stands first, as HTML.
        body: the sections.
        data: what the view draws (:func:`gpca.model.shown.packing.packed_scene`); None leaves it out.
    """
    view = "" if data is None else f"{_view(len(data['poses']))}\n"
    script = "" if data is None else _script(data)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{ALONE}">
<title>{escape(title)}</title>
<link rel="icon" href="data:,">
<style>
{_asset("page.css")}</style>
</head>
<body>
<header>
{head}
</header>
<main>
{view}<div class="facts">
{"".join(body)}</div>
</main>
{script}</body>
</html>
"""


def framed(html: str) -> str:
    """Return a page as a frame of a notebook, whose style and script touch nothing around it."""
    style = f"width:100%;height:{FRAME_HEIGHT}px;border:1px solid #ccc"
    return f'<iframe srcdoc="{escape(html)}" style="{style}" title="Registration explained"></iframe>'


def _view(poses: int) -> str:
    others = "".join(
        f'<button type="button" data-view="pose:{k}" aria-pressed="false">Pose {k + 1}</button>' for k in range(poses)
    )
    return f"""<div class="view">
<div class="buttons" role="group" aria-label="Pose of the source">
<button type="button" data-view="start" aria-pressed="false">Before</button>
<button type="button" data-view="found" aria-pressed="true">After</button>{others}
</div>
<canvas id="view" tabindex="0" role="img" aria-label="Both clouds in 3-D; arrow keys turn them"></canvas>
<div class="buttons">
<label><input type="checkbox" id="show-source" checked> <span class="key source"></span>source</label>
<label><input type="checkbox" id="show-target" checked> <span class="key target"></span>target</label>
<label><input type="checkbox" id="by-distance" checked> distances</label>
<button type="button" id="reset">Reset view</button>
</div>
<div id="scale" class="scale"><span>0</span><i></i><span></span></div>
<p id="said" class="note" aria-live="polite"></p>
<noscript><p class="warnings">The view needs JavaScript.</p></noscript>
</div>"""


def _script(data: Mapping) -> str:
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" id="scene">{text}</script>\n<script>\n{_asset("view.js")}{SHOW}</script>\n'


@cache
def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")
