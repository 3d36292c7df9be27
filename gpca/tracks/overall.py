"""One score across tracks: the area under the curve of generalized risk over coverage, and ranks with ties.

A method answers what is wrong and how sure it is. Of the answers that are given down to a confidence, the generalized
risk is the share of all samples that are answered wrongly; its area over the coverage (AUGRC: Traub et al. 2024, as in
fd-shifts) is the mean risk of a wrong answer that is not held back. The score is the mean over the tracks.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gpca.evaluation.intervals import interval
from gpca.evaluation.measures import POOLED
from gpca.experiments.frame_causes import FEWEST_FAILURES
from gpca.tracks.published import Method, Published
from gpca.tracks.scoring import AREA, counts, groups_of, measured_of

NOTES = (
    "AUGRC: the mean over all thresholds of a method's confidence of the share of samples that it answers wrongly "
    "above it, in %; a cause counts that adds as much as the dominant one. Of depth frames, the mean over the kinds of "
    f"starts with at least {FEWEST_FAILURES} failures.",
    "Rank: by the mean over the tracks. Methods share the rank of the best of them unless the 95 % interval of their "
    "difference, paired by samples and draws, lies above 0. Who lacks a track has no rank.",
)


def areas(published: Published, submitted: Mapping[str, Method]) -> dict[str, np.ndarray]:
    """Return the AUGRC (1 + B,) of each method that names causes and has answered all counted samples of a track."""
    states, groups = counts(published), list(groups_of(published))
    pooled = [group for group in groups if group[0] == POOLED]
    chosen = pooled or [group for group in groups if _is_enough(published, states, group[0])] or groups
    methods = {method.name: method for method in published.methods} | dict(submitted)
    by_group = [measured_of(published, methods, rows, draws) for _, rows, draws in chosen]
    names = [name for name in methods if all(AREA in measured.get(name, ({},))[0] for measured in by_group)]
    return {name: np.mean([measured[name][0][AREA] for measured in by_group], axis=0) for name in names}


def _is_enough(published: Published, states: Mapping[str, Mapping[str, int]], group: str) -> bool:
    return all(states[group][state] >= FEWEST_FAILURES for state in published.track.required_states)


def ranks(mean_of: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Return the rank of each method by its values (1 + B,), the least first, which who is not shown worse shares."""
    ordered, ranked = sorted(mean_of, key=lambda name: mean_of[name][0]), {}
    first = 0
    for place, name in enumerate(ordered):
        if interval(mean_of[name] - mean_of[ordered[first]]).low > 0:
            first = place
        ranked[name] = first + 1
    return ranked


def overall(tracks: Sequence[tuple[Published, Mapping[str, Method]]]) -> dict[str, Any]:
    """Return the board of all tracks, as :func:`gpca.tracks.leaderboard.board_of` returns one of each."""
    track_areas = {published.track.name: areas(published, submitted) for published, submitted in tracks}
    titles = {
        method.name: (method.title, method.name in submitted)
        for published, submitted in tracks
        for method in (*published.methods, *submitted.values())
    }
    everywhere = [name for name in titles if all(name in values for values in track_areas.values())]
    means = {name: np.mean([values[name] for values in track_areas.values()], axis=0) for name in everywhere}
    ranked = ranks(means)
    rows = []
    for name in sorted(titles, key=lambda name: means[name][0] if name in means else np.inf):
        title, is_submitted = titles[name]
        cells: list[dict[str, Any]] = [{"text": title, "value": title}]
        cells.append({"text": str(ranked.get(name, "–")), "value": ranked.get(name, "")})
        for values in (means, *track_areas.values()):
            cells.append(_cell(values[name]) if name in values else {"text": "–", "value": ""})
        if any(name in values for values in track_areas.values()):
            rows.append((is_submitted, [cell | {"bold": ranked.get(name) == 1} for cell in cells]))
    heads = ["Method", "Rank", "Mean AUGRC (%)", *(f"{name} (%)" for name in track_areas)]
    return {"title": "All tracks", "heads": heads, "labels": 1, "rows": rows, "notes": list(NOTES)}


def _cell(value_B: np.ndarray) -> dict[str, Any]:
    value, low, high = (100 * each for each in interval(value_B))
    return {"text": f"{value:.1f} ({low:.1f} to {high:.1f})", "value": value}
