"""GP-CA on depth frames, by backbone and reduction (paper Table VI)."""
