"""Files of weights: an encoder with its head, and the source and seed that it was trained on."""

from __future__ import annotations

from pathlib import Path

from gpca.encoders.settings import EncoderSettings
from gpca.encoders.tensor_file import read_tensors, write_tensors
from gpca.encoders.training import Classifier, make_model
from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.io.names import Axes, require_axes
from gpca.pairs.perturbation import CONCEPTS


def write_weights(path: str | Path, model: Classifier, axes: Axes) -> None:
    """Write what :func:`load_model` reads; `axes` are the source and the seed of the training samples."""
    source, seed = axes
    write_tensors(path, {"weights": model.state_dict(), "source": source, "seed": seed})


def load_model(
    path: Path,
    settings: EncoderSettings,
    classes: tuple[str, ...] = CONCEPTS,
    axes: Axes | None = None,
    unlike: Axes | None = None,
) -> Classifier:
    """Load encoder and head as the steps that train wrote them, ready for inference.

    Args:
        path: the file.
        settings: those that it was trained with.
        classes: those of its head.
        axes: the source and the seed that it has to be of; it may be of any where this is None.
        unlike: the source and the seed that it must not be of.

    Raises:
        InputError: missing, damaged, pickled or another encoder's weights, or those of another source or seed.
    """
    model = make_model(settings, classes)
    remedy = "regenerate them with Snakemake"
    require_file(path, "no such weights", remedy)
    try:
        content = read_tensors(path)
        own_axes = content["source"], content["seed"]
        model.load_state_dict(content["weights"])
    except Exception as fault:  # torch raises errors of many kinds for a damaged or foreign file
        raise InputError(path, f"not the weights of backbone '{settings.backbone}', or damaged", remedy) from fault
    require_axes(path, own_axes, axes)
    if own_axes == unlike:
        raise InputError(path, "was trained on the same samples", "give weights of another source or seed")
    return model.eval()
