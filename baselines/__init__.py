"""Rival explainers, one per file, found by :mod:`gpca.explainers.registry`."""
