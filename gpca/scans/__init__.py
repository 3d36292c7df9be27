"""Scans that are registered to scans: pairs of clouds of real or virtual sensors, with their true poses."""
