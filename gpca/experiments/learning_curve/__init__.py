"""How the diagnosis of causes grows with the number of training samples."""
