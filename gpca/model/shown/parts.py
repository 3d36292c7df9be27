"""The parts of the page of an explanation, as HTML; everything that a user gave is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from math import sqrt

from gpca.causes.shapley import BY_SIZE
from gpca.guarantee.alarm import ALARM, GOOD
from gpca.guarantee.states import STATES
from gpca.model.diagnosis import UNKNOWN
from gpca.model.guaranteed import IN_WORDS
from gpca.model.reenacted import FittingPose, Reenacted
from gpca.model.shown.subsets import WITHOUT, taken_out
from gpca.recovery.policy import NOTHING

CALLS = {GOOD: "good", ALARM: "bad"}  # the look of a call; neither is doubtful
TONES = {"nominal": "good", "failed": "bad", UNKNOWN: "doubt"}


def headline(explained: Mapping) -> str:
    """Return what was found, in one line."""
    diagnosis = explained["diagnosis"]
    if diagnosis is None:
        return f"<h1>The leading concept is {escape(explained['concept'])}</h1>"
    said = {
        "nominal": "This registration succeeded",
        "failed": f"This registration failed: {' and '.join(diagnosis['named'])}",
        UNKNOWN: "Nothing can be said of this registration",
    }[diagnosis["state"]]
    line = f'<h1 class="{TONES[diagnosis["state"]]}">{escape(said)}</h1>'
    if diagnosis["state"] == UNKNOWN:
        return line
    chance = f"Probability of failure {diagnosis['failure']:.2f}; called a failure from {diagnosis['threshold']:.2f} on"
    return f"{line}<p>{chance}. Expected error {length(diagnosis['expected_error'], explained['unit'])}.</p>"


def action(explained: Mapping, advice: str) -> str:
    """Return what to do, and why."""
    do = "nothing" if explained["action"] == NOTHING else advice
    why = f"<p>Reason: {escape(explained['reason'])}.</p>"
    return section("What to do", f'<p class="action">{sentence(do)}</p>{why}')


def promise(explained: Mapping) -> str:
    """Return the set of states and the call, with what is promised of them."""
    diagnosis = explained["diagnosis"]
    if diagnosis is None or diagnosis["state"] == UNKNOWN:
        return ""
    if (guarantee := diagnosis["guarantee"]) is None:
        return section("What is guaranteed", "<p>Nothing: a fast explanation, or a model without a guarantee.</p>")
    chips = "".join(
        f'<li class="{"in" if state in guarantee["states"] else "out"}">{escape(IN_WORDS.get(state, state))}</li>'
        for state in STATES
    )
    counted = (
        f"It was calibrated on {guarantee['families']} families of shapes that the classifier had not learned, and "
        "holds for objects that are to those of the training as these are to one another."
        if guarantee["families"]
        else "It was calibrated on single registrations of objects that the classifier had not learned."
    )
    risks = {
        GOOD: f"At most {guarantee['missed']:.0%} of all failures are called good.",
        ALARM: f"At most {guarantee['false_alarms']:.0%} of all good registrations are called failed.",
    }
    risk = risks.get(guarantee["call"], "Neither “good” nor “failed” would keep its promise here.")
    call = f'<span class="call {CALLS.get(guarantee["call"], "doubt")}">{escape(guarantee["call"])}</span>'
    return section(
        "What is guaranteed",
        f'<ul class="chips" aria-label="Set of states">{chips}</ul>'
        f"<p>The true state is one of those marked: {guarantee['level']:.0%} of such sets hold it. {counted}</p>"
        f"<p>Failure alarm: {call}. {risk}</p>",
    )


def causes(explained: Mapping) -> str:
    """Return the probability of each cause with its standard deviation, and what the cause adds to the error."""
    diagnosis, unit = explained["diagnosis"], explained["unit"]
    if diagnosis is None:
        return ""
    effects = diagnosis["reenacted"]["effects"] if diagnosis["reenacted"] else {}
    rows = [
        (cause, share, sqrt(diagnosis["variances"][cause]), length(effects[cause], unit) if effects else "")
        for cause, share in diagnosis["causes"].items()
    ]
    bars = [bar(cause, share, spread, said) for cause, share, spread, said in rows]
    note = "Probability that each is a cause, if the registration failed, ± the standard deviation of the posterior"
    adds = "; on the right, what it adds to the re-enacted error." if effects else "."
    return section("Causes", "".join(bars) + f'<p class="note">{note}{adds}</p>')


def poses(words: Sequence[str], fitting: Sequence[FittingPose], measured: str = "") -> str:
    """Return the poses that fit, each a button that shows it.

    Args:
        words: where each lies.
        measured: what else is to be said.
    """
    if not words:
        return ""
    items = [
        f'<li><button type="button" data-view="pose:{k}">Pose {k + 1}</button> <span>{sentence(said)}</span>'
        f"{share_bar(pose.probability)}</li>"
        for k, (said, pose) in enumerate(zip(words, fitting, strict=True))
    ]
    note = f'<p class="note">{escape(measured)}</p>' if measured else ""
    return section("Poses that fit", f'<ol class="poses">{"".join(items)}</ol>{note}')


def measured(found: Reenacted, unit: str) -> str:
    """Return what the most probable pose says of the observation, in words."""
    return (
        f"Under pose 1, the noise is {length(found.noise, unit)} per axis, {found.outliers:.0%} of the points are "
        f"outliers, and {found.missing:.0%} of the surface was not seen."
    )


def counterfactuals(
    errors: Sequence[Sequence[float]], limit: float, unit: str, without: Mapping[str, str] = WITHOUT
) -> str:
    """Return the eight re-enacted registrations under each hypothesis, each a button that shows its cloud.

    Args:
        errors: v̂ of each hypothesis and subset, in `unit`.
        limit: error from which a registration has failed, in `unit`.
        without: what it means that each cause is taken out, in words.
    """
    if not errors:
        return ""
    most = max(max(map(max, errors)), 1.2 * limit)
    groups = []
    for k, error_8 in enumerate(errors):
        rows = [
            f'<button type="button" class="what-if" data-view="what:{k}:{place}">'
            f'<span>{escape(taken_out(subset, without))}</span><span class="bar">'
            f'<i style="width:{100 * error_8[subset] / most:.1f}%"></i>'
            f'<b class="limit" style="left:{100 * limit / most:.1f}%"></b></span>'
            f"<span>{length(error_8[subset], unit)}</span></button>"
            for place, subset in enumerate(BY_SIZE)
        ]
        groups.append(f'<div class="what-ifs" data-hypothesis="{k}">{"".join(reversed(rows))}</div>')
    note = (
        f'The registration was run again as if pose <span id="hypothesis">1</span> were true, with causes taken out. '
        f"Bars are mean errors over starts around it; the line is the limit of a failure, {length(limit, unit)}. "
        "Choose a row to see its cloud, from the start itself."
    )
    return section("What if?", f'<p class="note">{note}</p>{"".join(groups)}')


def as_in_the_paper(explained: Mapping) -> str:
    """Return GP-CA's scores."""
    if not explained.get("scores"):
        return ""
    bars = "".join(
        bar(name, score, sqrt(explained["variances"][name]), "") for name, score in explained["scores"].items()
    )
    note = "It sees the aligned source alone and names a concept even where nothing is wrong."
    return section("GP-CA as in the paper", f'{bars}<p class="note">{note}</p>')


def details(explained: Mapping, names: Mapping[str, str]) -> str:
    """Return the pose, how well the clouds fit there, what was used, and the notes."""
    unit = explained["unit"]
    rows = {
        **{name.capitalize(): value for name, value in names.items() if value},
        "Registration": f"{explained['method']}, fitness {explained['fitness']:.3f}, inlier RMSE "
        f"{length(explained['inlier_rmse'], unit)}",
        "Unit": unit,
    }
    listed = "".join(f"<dt>{escape(name)}</dt><dd>{escape(str(value))}</dd>" for name, value in rows.items())
    matrix = "\n".join(" ".join(f"{number:12.6g}" for number in row) for row in explained["T_target_source"])
    notes = "".join(f"<li>{escape(note)}</li>" for note in explained["notes"])
    return section(
        "Details",
        f"<dl>{listed}</dl><p>T_target_source</p><pre>{matrix}</pre>" + (f"<ul>{notes}</ul>" if notes else ""),
    )


def warnings(lines: Iterable[str]) -> str:
    """Return the reasons to doubt all of this."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<ul class="warnings">{items}</ul>' if items else ""


def section(title: str, body: str) -> str:
    """Return a part of the page with its heading."""
    return f"<section><h2>{escape(title)}</h2>{body}</section>\n"


def bar(name: str, share: float, spread: float, said: str) -> str:
    """Return a probability as a bar with a whisker of one standard deviation."""
    low, high = max(0.0, share - spread), min(1.0, share + spread)
    return (
        f'<div class="row"><span>{escape(name)}</span><span class="bar"><i style="width:{100 * share:.1f}%"></i>'
        f'<b style="left:{100 * low:.1f}%;width:{100 * (high - low):.1f}%"></b></span>'
        f"<span>{share:.2f} ± {spread:.2f}</span><span>{escape(said)}</span></div>"
    )


def share_bar(share: float) -> str:
    """Return a probability as a bar."""
    return (
        f'<span class="share"><span class="bar"><i style="width:{100 * share:.1f}%"></i></span>'
        f"<span>{share:.2f}</span></span>"
    )


def length(value: float, unit: str) -> str:
    """Return a length in words."""
    return f"{value:.2g} {unit}"


def sentence(text: str) -> str:
    """Return escaped text that begins with a capital letter."""
    return escape(text[:1].upper() + text[1:])
