"""The Gaussian process classifier, its updates by labels, and the grid of kernels and schedules."""
