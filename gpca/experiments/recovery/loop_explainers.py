"""The explainers that policies of recovery read. They learn from other scenes of the same camera."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.experiments.recovery.answers import Explain
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.uncertainty.designs import evaluate_design
from gpca.uncertainty.settings import UncertaintySettings

Attach = Callable[[Registrations], Registrations]


@dataclass(frozen=True)
class LoopExplainers:
    """Explainers by name, and how well each does on the calibration samples.

    Attributes:
        explain: for each name the function that attributes registrations without labels.
        fitted: for each name the explainer itself.
        attach: for each name the function that adds to registrations what the explainer reads.
        calibration: for each name its predictions for the calibration samples.
        concepts: (N,) the truth about those.
    """

    explain: Mapping[str, Explain]
    fitted: Mapping[str, Any]
    attach: Mapping[str, Attach]
    calibration: Mapping[str, Attribution]
    concepts: np.ndarray

    def right(self, name: str) -> np.ndarray:
        """Return which calibration samples (N,) an explainer attributes rightly."""
        return self.calibration[name].predicted_N == self.concepts


def learn_explainers(
    names: Iterable[str],
    registrations: Registrations,
    encoder: EncoderSettings,
    settings: Mapping[str, Mapping],
    uncertainty: UncertaintySettings,
    most_remedied: int,
    source: str,
    seed: int,
) -> LoopExplainers:
    """Train the encoder and fit every explainer on the split ``train``; the other split is for calibration.

    Args:
        names: explainers (:mod:`gpca.explainers.registry`) that read embeddings or the design ``removal``.
        settings: explainer -> its settings.
        most_remedied: training samples whose remedies are run, at most; Monte-Carlo ICP is slow.
    """
    train, held_out = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
    fitted, attached = {}, {}
    model = None
    for name in names:
        entry = explainer_entry(name)
        explainer = entry.make(source, seed, **(settings.get(name) or {}))
        if entry.reads == "embeddings":
            model = model or train_encoder(registrations, source, seed, encoder)[0]
            attach = _embedding(model, source, seed, encoder)
            learned = train
        else:
            attach = _remedies(source, seed, uncertainty)
            learned = train.subset(np.arange(len(train))[:most_remedied])
        explainer.fit(attach(learned))
        fitted[name], attached[name] = explainer, attach
    explain = {name: _timed(explainer, attached[name]) for name, explainer in fitted.items()}
    calibration = {name: of_name(held_out.without_labels()) for name, of_name in explain.items()}
    return LoopExplainers(explain, fitted, attached, calibration, held_out.concept)


def _timed(explainer, attach) -> Explain:
    def explain(registrations: Registrations) -> Attribution:
        started = perf_counter()
        attached = attach(registrations)
        attribution = explainer.explain(attached)
        # All get the same, as the encoder sees many at once; the explainer's own seconds hold what remedies took too.
        each = (perf_counter() - started) / len(registrations)
        return replace(attribution, seconds_N=np.full(len(registrations), each))

    return explain


def _embedding(model, source: str, seed: int, settings: EncoderSettings):
    def attach(registrations: Registrations) -> Registrations:
        h_S_d, logits_S_C = embed(model, registrations, source, seed, settings)
        return replace(registrations, attached={"embedding": h_S_d, "head_logits": logits_S_C})

    return attach


def _remedies(source: str, seed: int, settings: UncertaintySettings):
    def attach(registrations: Registrations) -> Registrations:
        outcomes, *seconds = evaluate_design("removal", registrations, source, seed, settings)
        return outcomes.attach_to(registrations, *seconds)

    return attach
