"""How often each explainer names the concept that was perturbed, and what that costs (Tables I and II)."""

from gpca.experiments.experiment import Experiment

EXPERIMENT = Experiment(name="concept_attribution", tidy=("metrics.csv", "timings.csv"))
