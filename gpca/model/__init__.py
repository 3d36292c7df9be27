"""One registration of a user: the model file, its explanation, and how long it takes."""
