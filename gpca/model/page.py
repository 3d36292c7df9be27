"""The HTML page of an explanation, from its `as_dict`: one file, without a network; text from users is escaped."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from math import sqrt
from string import Template

from gpca.causes.policy import NOTHING
from gpca.causes.truth import BY_SIZE, FAILED
from gpca.evaluation.conformal import ALARM, GOOD
from gpca.guarantee.guarantee import STATES, WHETHER_FAILED
from gpca.model.diagnosis import AS_FAR, IN_WORDS, UNKNOWN, Diagnosis, Guaranteed, Reenacted
from gpca.model.scene import ASSETS, WITHOUT, Scene, taken_out
from gpca.numerals import in_decimals

FRAME_HEIGHT = 900  # of a notebook's frame, pixels
SHOW = 'openView().load(JSON.parse(document.getElementById("scene").textContent));\n'
CALLS = {GOOD: "good", ALARM: "bad"}  # CSS class of a call; others are "doubt"
TONES = {"nominal": "good", "failed": "bad", UNKNOWN: "doubt"}


def assembled(title: str, head: str, body: Sequence[str], scene: Scene | None, unit: str) -> str:
    text = {path.name: path.read_text(encoding="utf-8") for path in ASSETS.iterdir()}
    view = script = ""
    if scene is not None:
        buttons = (
            f'<button type="button" data-view="pose:{k}" aria-pressed="false">Pose {k + 1}</button>'
            for k in range(len(scene.possibilities) or len(scene.T_others))
        )
        view = Template(text["view.html"]).substitute(poses="".join(buttons))
        data = json.dumps(scene.packed(unit), separators=(",", ":")).replace("<", "\\u003c")
        script = f'<script type="application/json" id="scene">{data}</script>\n'
        script += f"<script>\n{text['view.js']}{SHOW}</script>\n"
    parts = {"title": escape(title), "style": text["page.css"], "head": head, "body": "".join(body)}
    return Template(text["page.html"]).substitute(parts, view=view, script=script)


def framed(html: str) -> str:
    """Wrap a page in a frame for notebooks, so that its style and script stay inside."""
    style = f"width:100%;height:{FRAME_HEIGHT}px;border:1px solid #ccc"
    return f'<iframe srcdoc="{escape(html)}" style="{style}" title="Registration explained"></iframe>'


def headline(explained: Mapping) -> str:
    diagnosis = explained["diagnosis"]
    state = diagnosis["state"]
    probably = "probably " * diagnosis["doubtful"]
    title = {
        "nominal": f"This registration {probably}succeeded",
        "failed": f"This registration {probably}failed: {' and '.join(diagnosis['named'])}",
        UNKNOWN: "The state of this registration is unknown",
    }[state]
    line = f'<h1 class="{TONES[state]}">{escape(title)}</h1>'
    if state == UNKNOWN:
        return line
    if caveat := diagnosis["caveat"]:
        line += f"<p>{sentence(caveat)}.</p>"
    tolerance, error = (length(diagnosis[name], explained["unit"]) for name in ("tolerance", "expected_error"))
    chance = f"The pose is off by more than {tolerance} with probability {diagnosis['result']:.2f}"
    called = f"called failed from {diagnosis['threshold']:.2f} on; expected error {error}"
    start = f"Registrations from {AS_FAR} fail with probability {diagnosis['start']:.2f}"
    return f"{line}<p>{chance}, {called}. {start}.</p>"


def warnings(lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<ul class="warnings">{items}</ul>' if items else ""


def listed(title: str, lines: Sequence[str]) -> str:
    """Return a section with lines of text, whose first ten columns are a word."""
    rows = "".join(f"<dt>{escape(line[:10].strip())}</dt><dd>{escape(line[10:])}</dd>" for line in lines)
    return section(title, f"<dl>{rows}</dl>")


def action(explained: Mapping, advice: str) -> str:
    do = sentence("nothing" if explained["action"] == NOTHING else advice)
    return section("What to do", f'<p class="action">{do}</p><p>Reason: {escape(explained["reason"])}.</p>')


def promise(guarantee: Guaranteed | None) -> str:
    if guarantee is None:
        return section("What is guaranteed", "<p>Nothing: a fast explanation, or a model without a guarantee.</p>")
    chips = "".join(
        f'<li class="{"in" if state in guarantee.states else "out"}">{escape(IN_WORDS.get(state, state))}</li>'
        for state in (WHETHER_FAILED if FAILED in guarantee.states else STATES)
    )
    answer, risk = guarantee.alarm
    call = f'<span class="call {CALLS.get(guarantee.call, "doubt")}">{answer}</span>'
    return section(
        "What is guaranteed",
        f'<ul class="chips" aria-label="Set of states">{chips}</ul>'
        f"<p>Such a set of marked states holds the true one in {guarantee.level:.0%} of cases. It was calibrated "
        f"{guarantee.basis}.</p>"
        f"<p>Failure alarm: {call}. {sentence(risk)}.</p>",
    )


def causes(diagnosis: Diagnosis, unit: str) -> str:
    bars = (
        bar(cause, share, diagnosis.variances[cause], length(diagnosis.reenacted.effects[cause], unit))
        for cause, share in diagnosis.causes.items()
    )
    note = (
        "Probability that each is a cause, if the registration failed, ± the standard deviation of the posterior; "
        "several can act at once. On the right, its Shapley share of the re-enacted error."
    )
    return section("Causes", f'{"".join(bars)}<p class="note">{note}</p>')


def poses(reenacted: Reenacted, unit: str, *, observation: bool = False) -> str:
    items = "".join(
        f'<li><button type="button" data-view="pose:{k}">Pose {k + 1}</button> '
        f"<span>{sentence(pose.words(unit))}</span>"
        f'<span class="share"><span class="bar"><i style="width:{100 * pose.probability:.1f}%"></i></span>'
        f"<span>{pose.probability:.2f}</span></span></li>"
        for k, pose in enumerate(reenacted.poses)
    )
    note = (
        f'<p class="note">Under pose 1, the noise is {escape(reenacted.noise_words(unit))} per axis (standard '
        f"deviation), {reenacted.outliers:.0%} of the source are outliers, and {reenacted.missing:.0%} of the target "
        "is unseen.</p>"
    )
    return section("Poses that fit", f'<ol class="poses">{items}</ol>{note if observation else ""}')


def counterfactuals(
    scene: Scene, unit: str, without: Mapping[str, str] = WITHOUT, bars: str = "mean errors over starts around it"
) -> str:
    if not scene.possibilities:
        return ""
    errors = [[scene.frame.diameter * error for error in pose.errors] for pose in scene.possibilities]
    limit = scene.frame.diameter * scene.limit
    most = max(max(map(max, errors)), 1.2 * limit)
    groups = []
    for k, error_8 in enumerate(errors):
        rows = [
            f'<button type="button" class="what-if" data-view="what:{k}:{number}">'
            f'<span>{escape(taken_out(subset, without))}</span><span class="bar">'
            f'<i style="width:{100 * error_8[subset] / most:.1f}%"></i>'
            f'<b class="limit" style="left:{100 * limit / most:.1f}%"></b></span>'
            f"<span>{length(error_8[subset], unit)}</span></button>"
            for number, subset in enumerate(BY_SIZE)
        ]
        groups.append(f'<div class="what-ifs" data-hypothesis="{k}">{"".join(reversed(rows))}</div>')
    note = (
        f'The registration was run again as if pose <span id="hypothesis">1</span> were true, with causes taken out. '
        f"Bars are {bars}; the line is the limit of a failure, {length(limit, unit)}. "
        "Choose a row to see its cloud, from the start itself."
    )
    return section("What if?", f'<p class="note">{note}</p>{"".join(groups)}')


def as_in_the_paper(explained: Mapping) -> str:
    bars = (bar(name, score, explained["variances"][name], "") for name, score in explained["scores"].items())
    note = "It sees the aligned source alone and names a concept even where nothing is wrong."
    doubts = warnings(explained["gpca_warnings"])
    return section("GP-CA as in the paper", f'{doubts}{"".join(bars)}<p class="note">{note}</p>')


def details(explained: Mapping, names: Mapping[str, str], pose_rows: Sequence[str]) -> str:
    rmse = length(explained["inlier_rmse"], explained["unit"])
    rows = {name.capitalize(): value for name, value in names.items() if value} | {
        "Registration": f"{explained['method']}, fitness {explained['fitness']:.3f}, inlier RMSE {rmse}",
        "Unit": explained["unit"],
    }
    if moved := explained["moved"]:
        distance = length(moved["distance"], explained["unit"])
        rows["Moved"] = f"{moved['rotation_deg']:.3g}° and {distance} from the initial pose"
    listed = "".join(f"<dt>{escape(name)}</dt><dd>{escape(str(value))}</dd>" for name, value in rows.items())
    matrix = "\n".join(pose_rows)
    notes = "".join(f"<li>{escape(note)}</li>" for note in explained["notes"])
    body = f'<dl>{listed}</dl><p>T_target_source</p><pre tabindex="0">{matrix}</pre>'
    body += f"<ul>{notes}</ul>" if notes else ""
    return section("Details", body)


def section(title: str, body: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{body}</section>\n"


def bar(name: str, share: float, variance: float, note: str) -> str:
    spread = sqrt(variance)
    low, high = max(0.0, share - spread), min(1.0, share + spread)
    return (
        f'<div class="row"><span>{escape(name)}</span><span class="bar"><i style="width:{100 * share:.1f}%"></i>'
        f'<b style="left:{100 * low:.1f}%;width:{100 * (high - low):.1f}%"></b></span>'
        f"<span>{share:.2f} ± {spread:.2f}</span><span>{escape(note)}</span></div>"
    )


def length(value: float, unit: str) -> str:
    return f"{in_decimals(value)} {unit}"


def sentence(text: str) -> str:
    return escape(text[:1].upper() + text[1:])
