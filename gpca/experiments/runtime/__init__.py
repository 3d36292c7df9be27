"""How long each stage of GP-CA takes (paper Table VII)."""
