"""Perturbed pairs of clouds, aligned and labeled."""
