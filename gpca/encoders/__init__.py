"""Point-cloud encoders and how they are trained."""
