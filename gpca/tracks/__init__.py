"""Tracks: fixed samples that methods from anywhere are tested on, beside the published rows; docs/adding.md."""
