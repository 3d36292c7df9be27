"""Step ``explain``: one explainer on all seeds of a source -> its predictions."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np

from gpca.attribution import read_timings, write_predictions, write_timings
from gpca.dataset import Registrations
from gpca.errors import InputError
from gpca.explainer import explainer_entry, require_settings
from gpca.files import load_arrays
from gpca.provenance import recorded
from gpca.settings import check_settings
from gpca.steps import per_seed


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` are the explainer's in the config."""
    parser.add_argument("--explainer", required=True)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=int, nargs="+")
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument("--embeddings", type=Path, nargs="*", help="for explainers that read them")
    parser.add_argument("--input-timings", required=True, type=Path, nargs="+", help="seconds spent before")
    parser.add_argument("--predictions", required=True, type=Path, nargs="+")
    parser.add_argument("--timings", required=True, type=Path, nargs="+")


def run(options: Namespace) -> None:
    """Fit on the training rows and explain every row, seed by seed."""
    require_settings(options.explainer, options.settings)
    check_settings(options.settings, "explainers", options.explainer)
    entry = explainer_entry(options.explainer)
    options.embeddings = options.embeddings or [None] * len(options.seeds)
    jobs = per_seed(options, "registrations", "embeddings", "input_timings", "predictions", "timings")
    for seed, registrations_path, embedding_path, input_timings, predictions, timings in jobs:
        inputs = [path for path in (registrations_path, embedding_path) if path]
        explainer = entry.make(options.source, seed, **options.settings)
        with recorded([predictions, timings], inputs, options.settings, seed=seed):
            registrations = Registrations.load(registrations_path)
            seconds_S, icp_seconds_S = read_timings(input_timings, registrations)
            if entry.reads == "embeddings":
                registrations = _with_embedding(registrations, embedding_path, options.explainer)
            explainer.fit(registrations.subset(registrations.rows("train")))
            observed = registrations if entry.oracle else registrations.without_labels()
            attribution = explainer.explain(observed)
            write_predictions(predictions, registrations, attribution)
            write_timings(
                timings,
                registrations,
                seconds_S + attribution.seconds_N,
                icp_seconds_S + attribution.icp_seconds_N,
            )


def _with_embedding(registrations: Registrations, path: Path | None, explainer: str) -> Registrations:
    if path is None:
        raise InputError(f"explainer '{explainer}'", "reads embeddings", "give them with --embeddings")
    shapes = {"h": ("S", "d"), "head_logits": ("S", "C"), "sample": ("S",), "split": ("S",)}
    arrays = load_arrays(path, shapes, made_by="python -m gpca embed")
    if not all(np.array_equal(arrays[name], getattr(registrations, name)) for name in ("sample", "split")):
        raise InputError(path, "holds other samples than the registrations", "make it anew with 'python -m gpca embed'")
    return replace(registrations, attached={"embedding": arrays["h"], "head_logits": arrays["head_logits"]})
