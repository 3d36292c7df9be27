"""Readings: choices that the paper leaves unstated, tried value by value to explain printed numbers."""
