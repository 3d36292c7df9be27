"""The shipped configs, as Snakemake merges them."""

import copy

import yaml

from gpca.config.layers import DEFAULTS
from gpca.settings import SCHEMA

CONFIG = SCHEMA.parents[2] / "config"
MISSING = object()


def merged(*parts):
    """Snakemake's way of laying one config over another."""
    whole = {}
    for part in parts:
        for key, value in part.items():
            both = isinstance(value, dict) and isinstance(whole.get(key), dict)
            whole[key] = merged(whole[key], value) if both else copy.deepcopy(value)
    return whole


def load(*names):
    paths = (*DEFAULTS, *(CONFIG / f"{name}.yaml" for name in names))
    return merged(*(yaml.safe_load(path.read_text()) for path in paths))


def changed(key, value):
    """The default config with the key (a path with dots) set to the value, or removed."""
    config = load()
    *path, last = key.split(".")
    section = config
    for name in path:
        section = section[name]
    if value is MISSING:
        del section[last]
    else:
        section[last] = value
    return config
