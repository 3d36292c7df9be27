"""One method of each kind for GP-CA Bench, to start from."""
