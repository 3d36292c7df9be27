"""How the configuration of a run is read and checked."""
