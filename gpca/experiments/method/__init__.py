"""Figures of the method: concepts, online inference, active learning, recovery (paper Figs. 2 to 4)."""
