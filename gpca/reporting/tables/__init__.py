"""Makes the tables and writes them as CSV, Markdown and JSON."""
