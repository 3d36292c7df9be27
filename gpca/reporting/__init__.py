"""Makes tables, figures and the page from files, in one style, and computes no result."""
