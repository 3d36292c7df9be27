"""What to do about an uncertain registration, and a closed loop that measures it."""
