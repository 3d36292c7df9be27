"""Depth frames, real or of a virtual camera: from masks and poses to registrations."""
