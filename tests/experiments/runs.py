"""Runs that tests of experiments make tables of."""

from gpca.config.layers import with_defaults
from gpca.declarations.plan import Run

YCB = {"title": "YCB", "kind": "bop"}
SOURCES = {"ycb": YCB, "cups": {"title": "Cups", "kind": "procedural"}}  # the second one is a stand-in

SOLIDS = {  # parts of a config whose figures show one source
    "figures": {"source": "solids"},
    "sources": {"solids": {"title": "Solids", "kind": "procedural"}},
    "embedding": {"encoder": "dgcnn", "reduction": "none"},
}


def run_with(**sections):
    """A run with the defaults of the config and these sections."""
    return Run(with_defaults({}) | {"sources": SOURCES} | sections)
