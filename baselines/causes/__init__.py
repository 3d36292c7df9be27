"""Explainers of causes, one kind per file: what is wrong with a registration, if anything, and why."""
