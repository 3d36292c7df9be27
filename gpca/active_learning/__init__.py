"""A new concept from few labels: acquisition, rounds of labelling, streams, learning curves."""
