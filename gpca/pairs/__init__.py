"""Perturbed pairs of clouds, aligned and labelled."""
