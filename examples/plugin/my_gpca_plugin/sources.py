"""Kinds of sources are listed by the module that has ``from_entry``."""

SOURCES = {"my_boxes": "my_gpca_plugin.boxes"}
