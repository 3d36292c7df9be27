"""From test samples to numbers: measures, their intervals and differences, in one form of rows."""
