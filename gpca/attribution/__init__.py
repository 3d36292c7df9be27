"""What explainers say of registrations: scores, the prediction file, metrics, diagnostics."""
