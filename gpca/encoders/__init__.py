"""Point-cloud encoders, one file each, and how they are trained."""
