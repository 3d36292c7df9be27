"""Poses, ICP from one start and from many, and the frame that encoders see."""
