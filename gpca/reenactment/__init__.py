"""The truth's counterfactuals, enacted by an observer who estimates the true pose and the clean clouds."""
