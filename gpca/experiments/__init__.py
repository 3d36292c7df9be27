"""What is asked of the method: a folder for each experiment, which declares itself in its ``experiment.py``."""
