"""Measurements of a pair of clouds after ICP, which need no knowledge of what was done to it."""
