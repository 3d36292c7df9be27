"""Policies and actions for uncertain registrations, and the settings of the closed loop that measures them."""
