"""The experiments: a folder for each, which declares itself in its ``experiment.py``."""
