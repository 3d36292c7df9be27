"""The numbers that the paper prints beside those of a run, and a run beside its reference."""
