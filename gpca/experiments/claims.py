"""Sentences of the paper, tested by the differences in a run."""

from collections.abc import Mapping
from typing import Any

from gpca.comparison.claims import claims as table_of_claims
from gpca.comparison.claims import read_verdicts
from gpca.declarations import Experiment, Run, table
from gpca.experiments.active_learning import titles
from gpca.experiments.frames import frames_of
from gpca.experiments.out_of_distribution import learner_titles
from gpca.experiments.recovery import policy_titles
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD

EXPERIMENT = Experiment(name="claims", beside=("verdict_map",))


def compared_sources(run: Run) -> dict[str, Mapping[str, Any]]:
    """Title of all that numbers are of, and whether it is a stand-in: sources, depth frames, model, rendered tables."""
    frames = frames_of(run.config)
    sources = run.sources | {REAL_WORLD: frames, ONE_ENCODER: frames}
    tables = {"title": "Virtual tables", "stand_in": sources[run.config["recovery"]["objects"]]["stand_in"]}
    return {**sources, "model": sources[run.config["model"]["source"]], "recovery": tables}


@table(
    "What the paper says in sentences",
    "Sentences of the paper, tested",
    """Each sentence of the paper with its comparisons: the difference paired by seed, its interval, and whether it
    supports the sentence. "As good as" needs an interval within a margin, not merely one that contains
    zero.""",
    verdicts=(read_verdicts, "claims.csv"),
)
def claims(run: Run, verdicts):
    config = run.config
    called = policy_titles(config) | learner_titles(config) | titles(config["active_learning"]["strategies"])
    called |= run.titles(explainer_entry, config["explainers"])
    return table_of_claims(verdicts, compared_sources(run), called)
