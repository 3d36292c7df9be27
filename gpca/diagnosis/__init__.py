"""How well explainers say what is wrong with a registration, measured against the truth of its causes."""
