"""Guarantees for what is said of a registration: a set that holds its state, and an alarm that seldom errs."""
