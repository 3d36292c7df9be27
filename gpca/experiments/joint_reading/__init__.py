"""One reading of all that the paper leaves open together, searched on development objects (Table XVI)."""
