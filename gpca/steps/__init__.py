"""The steps of the workflow as commands, one file each: files in, one function of the library, files out."""
