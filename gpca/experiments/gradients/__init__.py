"""What GP-CA's scores react to: gradients in the points of a cloud (saliency) and along concept vectors (TCAV)."""
