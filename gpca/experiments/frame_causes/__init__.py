"""Causes of failed registrations of depth frames, measured and explained (Table IX on frames)."""
