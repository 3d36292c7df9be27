"""Figures; nothing here computes a result."""
