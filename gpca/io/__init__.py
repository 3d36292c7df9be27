"""Files of all kinds, read and written: whole or not at all, within limits, with one clear line for each fault."""
