"""What a job is given, its arguments, and the provenance of what it writes."""
