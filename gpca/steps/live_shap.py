"""Step ``explain_live``: Shapley values by ``shap.KernelExplainer`` on a live function, beside those of a table."""

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.classifier.scores import Attribution
from gpca.evaluation.measures import ALL, tidy, write_metrics
from gpca.explainers.registry import explainer_entry
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations
from gpca.process.progress import progress
from gpca.uncertainty.designs import LiveUncertainty, design_rows
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, Knobs
from gpca.uncertainty.outcomes import Outcomes
from gpca.uncertainty.settings import UncertaintySettings

LOOKUP = "shap_additive"  # the compared explainer; its design has the coalitions in a table


def run(job: Job) -> None:
    runs = {name: value for name, value in job.section("additive").items() if name != "samples"}
    settings = UncertaintySettings(**runs, icp=ICPSettings(**job.section("icp")))
    samples = job.section("live_shap")["samples"]
    for seed, registrations, outcomes, out in job.per_seed("registrations", "outcomes", "out"):
        axes = (job.source, seed)
        with record_provenance([out], [registrations, outcomes], job.settings, seed=seed):
            observed, loaded = Registrations.load(registrations, axes).without_labels(), Outcomes.load(outcomes, axes)
            no_seconds = np.zeros(loaded.uncertainty.shape)
            tabled = loaded.attach_to(observed, no_seconds, no_seconds)
            chosen = tabled.subset(design_rows(tabled, "additive", samples))
            lookup = explainer_entry(LOOKUP).make(*axes).explain(chosen)
            functions = [LiveUncertainty(chosen, row, *axes, settings) for row in range(len(chosen))]
            title = f"live SHAP on {job.source}, seed {seed}"
            live_S_3 = np.array([live_values(uncertainty) for uncertainty in progress(functions, title)])
            metrics = compared(live_S_3, np.array([uncertainty.icp_calls for uncertainty in functions]), lookup)
            records = [("live_shap", job.source, LOOKUP, name, ALL, seed, value) for name, value in metrics.items()]
            write_metrics(tidy(records, "live_shap"), out)


def live_values(uncertainty: LiveUncertainty) -> np.ndarray:
    """Shapley values (3,) of the knobs in nats, turned from at rest to the middle of their ranges.

    With three features ``shap.KernelExplainer`` asks for all eight coalitions. Each call registers.
    """
    import shap

    def of_coalitions(present_M_3: np.ndarray) -> np.ndarray:
        settings = np.where(np.asarray(present_M_3) > 0.5, MIDDLE, UNTOUCHED)
        return np.array([uncertainty(Knobs(*setting)) for setting in settings])

    explainer = shap.KernelExplainer(of_coalitions, np.zeros((1, 3)))
    return np.ravel(explainer.shap_values(np.ones((1, 3)), l1_reg=False, silent=True))


def compared(live_S_3: np.ndarray, live_calls_S: np.ndarray, lookup: Attribution) -> dict[str, float]:
    """Metrics of live values and runs of ICP of S samples beside those of an explainer's table."""
    tabled_S_3 = lookup.scores_N_C
    return {
        "largest_value": float(np.abs(tabled_S_3).max()),
        "largest_difference": float(np.abs(live_S_3 - tabled_S_3).max()),
        "named_alike": float(np.mean(live_S_3.argmax(axis=1) == tabled_S_3.argmax(axis=1))),
        "live_icp_calls": float(live_calls_S.mean()),
        "icp_calls": float(lookup.icp_calls_N.mean()),
        "test_samples": float(len(live_S_3)),
    }
