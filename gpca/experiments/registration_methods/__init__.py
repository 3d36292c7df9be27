"""Registration methods side by side on the same pairs (Table XI)."""
