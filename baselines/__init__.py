"""Rival explainers, one per file, found by :func:`gpca.explainers.interface.explainers`."""
