"""The commands that people give: explain, label, ship, and the checks of a config and of a run."""
