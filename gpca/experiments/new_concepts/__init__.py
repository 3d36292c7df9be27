"""A new concept where no encoder has seen the samples, or the concept (Table XV)."""
