"""The model file and the explanation of a registration by a user."""
