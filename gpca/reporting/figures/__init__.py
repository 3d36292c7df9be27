"""Draws the figures; nothing here computes a result."""
