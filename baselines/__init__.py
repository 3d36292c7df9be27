"""Rival explainers, one per file, found by :mod:`baselines.registry`."""
