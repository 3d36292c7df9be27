"""Attributions of registrations to concepts: scores, the prediction file, metrics and diagnostics."""
