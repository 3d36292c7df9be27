"""A new concept on depth frames from few labels (paper Sec. IV-E)."""
