"""The interface of explainers, GP-CA behind it, and the features that it can read."""
