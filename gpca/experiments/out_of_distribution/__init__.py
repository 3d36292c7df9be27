"""Samples unlike those of the training, and how useful the uncertainty of learners is on them."""
