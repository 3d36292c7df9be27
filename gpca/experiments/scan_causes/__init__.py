"""Causes of failed registrations of scans to scans."""
