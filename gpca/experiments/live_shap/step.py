"""Step ``live_shap``: registrations and outcomes of design ``additive`` -> live Shapley values beside the table's."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.evaluation.measures import ALL, tidy, write_metrics
from gpca.experiments.live_shap.comparison import compared, live_values
from gpca.experiments.live_shap.experiment import LOOKUP
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.uncertainty.designs import LiveUncertainty, design_rows
from gpca.uncertainty.outcomes import Outcomes
from gpca.uncertainty.settings import UncertaintySettings


def run(job: Job) -> None:
    """Explain some test samples both ways, seed by seed."""
    runs = job.section("additive")
    runs = {name: value for name, value in runs.items() if name != "samples"}
    settings = UncertaintySettings(**runs, icp=ICPSettings(**job.section("icp")))
    samples = job.section("live_shap")["samples"]
    for seed, registrations, outcomes, out in job.per_seed("registrations", "outcomes", "out"):
        axes = (job.source, seed)
        with record_provenance([out], [registrations, outcomes], job.settings, seed=seed):
            observed = Registrations.load(registrations, axes).without_labels()
            metrics = _of_seed(observed, Outcomes.load(outcomes, axes), axes, samples, settings)
            records = [("live_shap", job.source, LOOKUP, name, ALL, seed, value) for name, value in metrics.items()]
            write_metrics(tidy(records, "live_shap"), out)


def _of_seed(
    observed: Registrations, outcomes: Outcomes, axes: tuple[str, int], samples: int, settings: UncertaintySettings
) -> dict[str, float]:
    no_seconds = np.zeros(outcomes.uncertainty.shape)
    tabled = outcomes.attach_to(observed, no_seconds, no_seconds)
    chosen = tabled.subset(design_rows(tabled, "additive", samples))
    lookup = explainer_entry(LOOKUP).make(*axes).explain(chosen)
    functions = [LiveUncertainty(chosen, row, *axes, settings) for row in range(len(chosen))]
    title = f"live SHAP on {axes[0]}, seed {axes[1]}"
    live_S_3 = np.array([live_values(uncertainty) for uncertainty in progress(functions, title)])
    return compared(live_S_3, np.array([uncertainty.icp_calls for uncertainty in functions]), lookup)
