"""The shipped configs, as Snakemake merges them."""

import copy
from functools import cache

import yaml
from snakemake.utils import update_config

from gpca.config.layers import DEFAULTS

CONFIG = DEFAULTS[0].parent
MISSING = object()


def merged(*parts):
    """The configs laid over each other by Snakemake itself."""
    whole = {}
    for part in parts:
        update_config(whole, copy.deepcopy(part))
    return whole


def load(*names):
    paths = (*DEFAULTS, *(CONFIG / f"{name}.yaml" for name in names))
    return merged(*map(_read, paths))


@cache
def _read(path):
    return yaml.safe_load(path.read_text())


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
