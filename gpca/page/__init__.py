"""Writes the page of a run, index.html."""
