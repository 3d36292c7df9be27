"""The interface of explainers, GP-CA behind it, and their classifiers."""
