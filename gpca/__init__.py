"""GP-CA Bench: Gaussian-process concept attribution for point cloud registration, and its rivals."""
