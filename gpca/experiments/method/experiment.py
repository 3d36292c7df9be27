"""The method in figures: overview, pipeline, concepts and objects (Figures 2 to 4)."""

from gpca.experiments.experiment import Experiment

EXPERIMENT = Experiment(name="method")
