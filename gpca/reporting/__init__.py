"""Makes tables and figures from files, in one style, and computes no result."""
