"""Inputs to zero mean and unit variance, as the classifier's kernels need them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Standardization:
    """Means and deviations (d,) of the inputs that it was fitted to; a constant input has the deviation 1.

    scikit-learn fits it. To apply it takes none of that, which loads for a second.
    """

    mean_d: np.ndarray
    scale_d: np.ndarray

    @classmethod
    def of(cls, h_N_d: np.ndarray) -> Standardization:
        """Fit it to inputs."""
        from sklearn.preprocessing import StandardScaler

        fitted = StandardScaler().fit(h_N_d)
        return cls(fitted.mean_, fitted.scale_)

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the standardized inputs, in their own precision."""
        precision = np.result_type(h_N_d, np.float32)
        return (h_N_d - self.mean_d.astype(precision)) / self.scale_d.astype(precision)
