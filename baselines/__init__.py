"""Rival explainers, one per file, found by :func:`gpca.explainer.explainers`."""
