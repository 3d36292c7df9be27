"""Active learning of new concepts: acquisition, rounds of labeling, streams, learning curves."""
