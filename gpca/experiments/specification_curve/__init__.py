"""Choices that the paper leaves unstated, tried value by value to explain printed numbers (docs/comparison.md)."""
