"""Tables, figures and their style: everything here draws from files and computes no result."""
