"""Accuracy of the explainers and success of the registrations by the severity of the perturbations (Table X)."""

from pathlib import Path
from textwrap import wrap

import numpy as np

from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, Paths, figure, numbers
from gpca.errors import InputError
from gpca.evaluation.measures import read_samples
from gpca.experiments.controls import SECTION, read_controls
from gpca.experiments.explained import titles
from gpca.io.csv_file import read_numbers
from gpca.reporting.figures.style import GRAY, SMALL_PT, write_title
from gpca.steps.control_samples import PAPER, SAMPLE_COLUMNS, SEVERITIES

BY_CONCEPT = {"noise": ("noise",), "pose": ("rotation_deg", "translation"), "overlap": ("crop",)}
REGISTRATION = "registration"  # in the column of explainers: the share of registrations that succeed
COLUMNS = ("concept", "method", "low", "high", "other_low", "other_high", "samples", "value")


@numbers(
    "control_severities.csv",
    files="controls/{source}/seed{control_seed}.csv",
    samples="control_samples/{source}/seed{control_seed}.csv",
)
def collect(run: Run, files: Paths, samples: Paths) -> Frame:
    """Accuracy of explainers and success of registrations by equally wide bins of severity, over all sources."""
    import pandas as pd

    from gpca.pairs.synthesis import RegistrationSettings

    bins, severities = run.config["controls"]["bins"], dict(run.config["registrations"]["severities"])
    ranges = RegistrationSettings.from_dict({"severities": severities}).severities
    limits = {name: getattr(ranges, name) for name in SEVERITIES}
    edges = {name: np.linspace(low, high, bins + 1) for name, (low, high) in limits.items()}
    predictions = read_controls(files)
    predictions = predictions[predictions["control"] == PAPER]
    table = read_samples(samples, lambda path: read_numbers(path, SAMPLE_COLUMNS, (*SEVERITIES, "error")), ("source",))
    table = table[table["control"] == PAPER].reset_index(drop=True)
    for name in SEVERITIES:  # the first bin where it was not applied
        table[f"bin_{name}"] = np.clip(np.searchsorted(edges[name], table[name], side="right") - 1, 0, bins - 1)
    keys = ["source", "seed", "sample"]
    joined = predictions.merge(table, on=keys, suffixes=("", "_of_sample"), validate="many_to_one")
    outcomes = table.assign(explainer=REGISTRATION, right=table["error"] < run.config["success"]["error"])
    both = pd.concat([outcomes, joined[outcomes.columns]])
    records = []
    for concept, names in BY_CONCEPT.items():
        subset = both[both["concept"] == concept]
        for (method, *numbers_of_bins), rows in subset.groupby(["explainer", *(f"bin_{n}" for n in names)], sort=False):
            bounds = [edges[name][i : i + 2] for name, i in zip(names, numbers_of_bins, strict=True)]
            four = np.concatenate([*bounds, [np.nan] * 2])[:4]
            records.append((concept, method, *four, len(rows), float(rows["right"].mean())))
    frame = pd.DataFrame(records, columns=list(COLUMNS))
    return frame.sort_values(list(COLUMNS[:6]), kind="stable", ignore_index=True)


def read_severities(path: str | Path) -> Frame:
    """Read what :func:`collect` returned; only pose has bounds of a second severity, its translation."""
    return read_numbers(path, COLUMNS, COLUMNS[2:], optional=("other_low", "other_high"))


PARTS = (  # concept, column of its lower bounds, title, factor to the unit that is shown
    ("noise", "low", "noise: deviation\n(% of the diameter)", 100.0),
    ("overlap", "low", "overlap: points\ncut off (%)", 100.0),
    ("pose", "low", "pose: rotation\n(°)", 1.0),
    ("pose", "other_low", "pose: translation\n(% of the diameter)", 100.0),
)
SUCCEEDS = "registration succeeds"
SAMPLES = "number of samples"
ROW_IN, HEAD_IN = 0.24, 0.95
LETTERS = 34  # in a line of an explainer's title


@figure(
    SECTION,
    "Accuracy and success by severity",
    """Accuracy under the paper's protocol, and the share of registrations that end near the truth, in bins of the
    perturbation's severity, for all sources; the first row counts the samples. Bins of rotation are over all
    translations, and the other way round. Where nearly all succeed, naming the perturbation explains no failure.""",
    severities=(read_severities, "control_severities.csv"),
)
def severity_curves(run: Run, severities) -> Figure:
    # Numbers, since curves would lie on each other at 100 %.
    explainers = titles(run.config["controls"]["explainers"])
    shown = [name for name in explainers if (severities["method"] == name).any()]
    if not shown:
        raise InputError("severities", "have none of these explainers", "run the controls first")
    from gpca.reporting.figures.panels import draw_percentages, panels

    parts = [part for part in PARTS if (severities["concept"] == part[0]).any()]
    drawing, [drawn] = panels(1, len(parts), HEAD_IN + ROW_IN * (len(shown) + 2), sharey=True)
    for panel, (concept, low, label, factor) in zip(drawn, parts, strict=True):
        rows = severities[severities["concept"] == concept]
        high, binned = low.replace("low", "high"), []
        for method in (REGISTRATION, *shown):  # by the bin of one severity, over all bins of the other
            chosen = rows[rows["method"] == method]
            weighted = chosen.assign(value=100 * chosen["value"] * chosen["samples"])
            weighted = weighted.assign(low=chosen[low], high=chosen[high])
            sums = weighted.groupby("low").agg({"value": "sum", "samples": "sum", "high": "first"})
            binned.append(sums.assign(value=sums["value"] / sums["samples"]))
        first = next(bins for bins in binned if len(bins))
        shares_R_B = np.array([bins["value"].reindex(first.index).to_numpy(float) for bins in binned])
        draw_percentages(panel, np.vstack([np.full(len(first), np.nan), shares_R_B]), "{:.0f}")
        for column, samples in enumerate(first["samples"]):
            panel.text(column, 0, f"{samples:.0f}", ha="center", va="center", fontsize=SMALL_PT, color=GRAY)
        panel.axhline(1.5, color="white", linewidth=2)  # above the explainers
        edges = factor * np.r_[first.index, first["high"].iloc[-1]]
        panel.set_xticks(np.arange(len(edges)) - 0.5, [f"{edge:.4g}" for edge in edges])
        panel.tick_params(labelsize=SMALL_PT, length=0)
        panel.spines[:].set_visible(False)
        panel.set_title(label, fontsize=SMALL_PT)
    names = [SAMPLES, SUCCEEDS, *("\n".join(wrap(explainers[name], LETTERS)) for name in shown)]
    drawn[0].set_yticks(range(len(names)), names, fontsize=SMALL_PT, linespacing=1.0)
    sources = ", ".join(entry["title"] for entry in run.sources.values()) + run.stand_ins()
    write_title(drawing, f"{sources}: accuracy and success (%) by severity")
    return drawing
