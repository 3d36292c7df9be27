"""A new concept from few labels: acquisition, rounds of labeling, streams, learning curves."""
