"""Kernels, learning rates and numbers of iterations (paper Table IV)."""
