"""Samples unlike those of the training, and what the uncertainty of learners is worth on them."""
