"""Actions of a robot on uncertain registrations, policies that choose them, and their settings."""
