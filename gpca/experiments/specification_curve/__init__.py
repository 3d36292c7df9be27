"""What the paper leaves unstated, tried value by value: which choice explains a printed number (docs/comparison.md)."""
