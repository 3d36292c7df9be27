"""Registration methods on scans of rooms and objects (Table XVII)."""
