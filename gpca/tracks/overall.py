"""One score across tracks, the mean AUGRC (Traub et al. 2024; `NOTES`), and ranks with ties."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gpca.evaluation.intervals import interval
from gpca.evaluation.measures import POOLED
from gpca.experiments.frame_causes import FEWEST_FAILURES
from gpca.tracks.published import NO_CALLS, Method, Published
from gpca.tracks.scoring import AREA, counts, groups_of, measured_of

WORST = 0.5  # AUGRC of who is always wrong
MOST_CALLS = 1000  # at the end of the axis of costs
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
    fewest = {name: min(of[state] for state in published.track.required_states) for name, of in states.items()}
    chosen = pooled or [group for group in groups if fewest[group[0]] >= FEWEST_FAILURES] or groups
    methods = {method.name: method for method in published.methods} | dict(submitted)
    by_group = [measured_of(published, methods, rows, draws) for _, rows, draws in chosen]
    names = [name for name in methods if all(AREA in measured.get(name, ({},))[0] for measured in by_group)]
    return {name: np.mean([measured[name][0][AREA] for measured in by_group], axis=0) for name in names}


def ranks(mean_of: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Return the rank of each method by its values (1 + B,), the least first, which who is not shown worse shares."""
    ordered, ranked = sorted(mean_of, key=lambda name: mean_of[name][0]), {}
    first = 0
    for place, name in enumerate(ordered):
        if interval(mean_of[name] - mean_of[ordered[first]]).low > 0:
            first = place
        ranked[name] = first + 1
    return ranked


def overall(
    tracks: Sequence[tuple[Published, Mapping[str, Method]]], links: Mapping[str, str]
) -> tuple[dict[str, Any], list[list[dict[str, Any]]]]:
    """Return the board of all tracks (:func:`gpca.tracks.leaderboard.board_of`), and :func:`costs_of` on each track."""
    track_areas = {published.track.name: areas(published, submitted) for published, submitted in tracks}
    methods: dict[str, Method] = {}
    calls_of: list[dict[str, int]] = []
    for published, sent in tracks:
        named = {method.name: method for method in (*published.methods, *sent.values())}
        methods = named | methods
        calls_of.append({name: method.icp_calls for name, method in named.items()})
    everywhere = [name for name in methods if all(name in values for values in track_areas.values())]
    means = {name: np.mean([values[name] for values in track_areas.values()], axis=0) for name in everywhere}
    most_calls = {name: max(calls.get(name, NO_CALLS) for calls in calls_of) for name in methods}
    ranked, rows = ranks(means), []

    def place(name: str) -> tuple[int, float]:
        risks = [values[name][0] for values in track_areas.values() if name in values]
        return -len(risks), float(np.mean(risks))

    for name in sorted((name for name in methods if any(name in of for of in track_areas.values())), key=place):
        calls = most_calls[name]
        cells: list[dict[str, Any]] = [{"text": methods[name].title} | ({"link": links[name]} if name in links else {})]
        cells.append({"text": str(ranked.get(name, "–"))})
        cells += [_cell(values.get(name)) for values in (means, *track_areas.values())]
        cells.append({"text": "–" if calls == NO_CALLS else str(calls)})
        submitted = any(name in of for _, of in tracks)
        rows.append({"submitted": submitted, "cells": [cell | {"bold": ranked.get(name) == 1} for cell in cells]})
    heads = ["Method", "Rank", "Mean AUGRC (%)", *(f"{name} (%)" for name in track_areas), "ICP runs"]
    board = {"title": "All tracks", "heads": heads, "groups": {"": rows}, "notes": NOTES}
    costs = [costs_of(*each, methods) for each in zip(track_areas.values(), calls_of, strict=True)]
    return board | {"costs": costs_of(means, most_calls, methods)}, costs


def costs_of(
    area_of: Mapping[str, np.ndarray], calls_of: Mapping[str, int], methods: Mapping[str, Method]
) -> list[dict[str, Any]]:
    """Return a point for each method with known ICP runs, the cheapest first: its place, as a share of both axes."""
    points: list[dict[str, Any]] = []
    counted = [name for name in area_of if calls_of[name] != NO_CALLS]
    for name in sorted(counted, key=lambda name: (calls_of[name], area_of[name][0])):
        cell, calls = _cell(area_of[name]), calls_of[name]
        is_best = all(cell["drawn"][1] < point["drawn"][1] for point in points)
        across = min(1.0, np.log1p(calls) / np.log1p(MOST_CALLS))
        words = f"{methods[name].title}: {cell['text']} %, {calls} runs of ICP"
        points.append({"words": words, "across": across, "drawn": cell["drawn"], "best": is_best})
    return points


def _cell(value_B: np.ndarray | None) -> dict[str, Any]:
    if value_B is None:
        return {"text": "–"}
    estimate = interval(value_B)
    value, low, high = (100 * each for each in estimate)
    drawn = [round(each / WORST, 4) for each in (estimate.low, estimate.value, estimate.high)]
    return {"text": f"{value:.1f} ({low:.1f} to {high:.1f})", "drawn": drawn}
