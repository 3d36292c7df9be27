"""Why registrations of depth frames fail, and what explainers say about it (Table IX on frames)."""
