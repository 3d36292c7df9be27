"""A new concept from few labels, by every acquisition strategy (paper Table III)."""
