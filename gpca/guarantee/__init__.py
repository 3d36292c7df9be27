"""Sets of states and alarms with bounded error rates, by conformal prediction."""
