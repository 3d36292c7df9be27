"""Policies of recovery on the same failures, with the same budget of actions (Table VIII)."""
