"""Estimators of a pose's covariance side by side on the same pairs (Table XII)."""
