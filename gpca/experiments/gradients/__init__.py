"""Gradients of GP-CA's scores: in the points of a cloud (saliency) and along concept vectors (TCAV)."""
