"""What the file of an experiment declares: settings, steps, numbers, tables and figures."""
