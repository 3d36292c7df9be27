"""The steps of the workflow, a function each: files in, files out."""
