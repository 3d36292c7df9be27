"""Explainers side by side on the paper's protocol (paper Tables I and II)."""
