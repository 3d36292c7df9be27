"""GP-CA Bench: Gaussian-process concept attribution for point cloud registration, and its rivals."""

__version__ = "0.4.0"  # the one place: pyproject.toml reads it here, and CITATION.cff is held to it by a test

_EXPORTS = {
    "CanonicalFrame": "gpca.objects.canonical",
    "Explainer": "gpca.model.explainer",
    "Explanation": "gpca.model.explanation",
    "explain_scans": "gpca.model.scan_explainer",
    "judge": "gpca.model.explainer",
    "load": "gpca.tracks.loading",
    "repair": "gpca.model.explainer",
    "repair_scans": "gpca.model.scan_explainer",
}
__all__ = ["__version__", *_EXPORTS]


def __getattr__(name: str):
    """Load an exported name only when it is used: it brings torch, and every step imports this package."""
    if name not in _EXPORTS:
        raise AttributeError(f"module 'gpca' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_EXPORTS[name]), name)
