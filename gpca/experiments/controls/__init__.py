"""Explanations when a shortcut is closed: other draws, unseen objects, other labels, other sources."""
