"""Registration methods side by side, and estimators of uncertainty: the same pairs, judged by the true pose."""
