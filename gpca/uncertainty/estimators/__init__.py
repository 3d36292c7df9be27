"""Estimators of a pose's covariance, one file each: the registry finds them by name."""
