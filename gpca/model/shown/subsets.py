"""The eight subsets of the causes, in words: by what is taken out."""

from __future__ import annotations

from collections.abc import Mapping

from gpca.causes.shapley import SUBSETS
from gpca.pairs.perturbation import CONCEPTS

WITHOUT = {"noise": "clean points", "pose": "right start", "overlap": "whole surface"}  # a cause that is taken out


def taken_out(subset: int, without: Mapping[str, str] = WITHOUT) -> str:
    """Return what a subset of the causes leaves out, in words."""
    gone = [without[name] for cause, name in enumerate(CONCEPTS) if cause not in SUBSETS[subset]]
    return ", ".join(gone).capitalize() or "As it was"
