"""Explainers with another registration method, or another estimator of uncertainty, beneath them."""
