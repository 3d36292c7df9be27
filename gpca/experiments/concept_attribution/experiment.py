"""How often each explainer names the concept that was perturbed, and at what cost (Tables I and II)."""

from gpca.experiments.experiment import Experiment, Tidy

EXPERIMENT = Experiment(
    name="concept_attribution",
    tidy=(
        Tidy(
            "metrics.csv",
            "gpca.attribution.metrics:collect",
            {
                "prediction_files": "predictions/{source}/{explainer}/seed{seed}.csv",
                "causal_files": "uncertainty/{source}/causal/seed{seed}.csv",
            },
        ),
        Tidy(
            "attribution_intervals.csv",
            "gpca.experiments.concept_attribution.intervals:collect_intervals",
            {
                "prediction_files": "predictions/{source}/{explainer}/seed{seed}.csv",
                "causal_files": "uncertainty/{source}/causal/seed{seed}.csv",
            },
        ),
        Tidy(
            "timings.csv",
            "gpca.attribution.metrics:collect_timings",
            {"timing_files": "timings/{source}/{explainer}/seed{seed}.csv"},
        ),
    ),
)
