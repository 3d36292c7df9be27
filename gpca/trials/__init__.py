"""Registration methods side by side: the same pairs registered by each of them, and judged by the true pose."""
