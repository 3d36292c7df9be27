"""What no schema can say of a config, section by section: names of what exists, and settings that fit each other."""
