"""Training an encoder with a head over the concepts (paper Sec. III-A); GP-CA reads the encoder, a rival the head.

Each epoch sees a fresh random subset of every cloud's points. There is no other augmentation: rotations and shifts
would erase the pose concept, jitter the noise concept, crops the overlap concept.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch
from torch import nn

from gpca.encoders.registry import make_encoder
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.tensor_file import read_tensors, require_like
from gpca.errors import InputError
from gpca.files import whole_file
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.progress import progress
from gpca.seeds import generator, seed_of

HIDDEN = 256  # units of a head of two layers


def draw_points(
    registrations: Registrations, rows: np.ndarray, n_points: int, *axes: object, fewest: int | None = None
) -> torch.Tensor | list[torch.Tensor]:
    """Return `n_points` random points of each row's aligned cloud, (B, N, 3) float32.

    The draw of a sample is named by the axes, its split and its number. Clouds of fewer points repeat some.

    Args:
        fewest: where it is given, each cloud has a random number of points from this one to `n_points`, or all that it
            has, and what is returned are B clouds (N, 3).
    """
    clouds = []
    for row in rows:
        points = registrations.cloud(row)
        random = generator(*axes, registrations.split[row], registrations.sample[row])
        count = n_points if fewest is None else min(int(random.integers(fewest, n_points + 1)), len(points))
        clouds.append(points[random.choice(len(points), count, replace=len(points) < count, shuffle=False)])
    if fewest is not None:
        return [torch.from_numpy(cloud.astype(np.float32)) for cloud in clouds]
    return torch.from_numpy(np.stack(clouds).astype(np.float32))


def _on(device: torch.device, clouds: torch.Tensor | list[torch.Tensor]) -> torch.Tensor | list[torch.Tensor]:
    return clouds.to(device) if isinstance(clouds, torch.Tensor) else [cloud.to(device) for cloud in clouds]


def train_encoder(
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    checkpoint: Path | None = None,
    classes: tuple[str, ...] = CONCEPTS,
) -> tuple[Classifier, list[dict[str, float]]]:
    """Train on the rows of split ``train``.

    Args:
        classes: what ``concept`` names.
        checkpoint: where the state after every epoch is kept; if it is there, of the same settings and data, training
            continues from it and ends with the same weights as an unbroken run.

    Returns:
        the model (``model.encoder``, ``model.head``), and the training curve: epoch, learning_rate, loss, accuracy.
    """
    torch.manual_seed(seed_of(source, seed, "encoder", settings.backbone))
    device = best_device()
    model = make_model(settings, classes).to(device)
    optimiser = torch.optim.AdamW(model.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)
    rows = registrations.rows("train")
    if len(rows) < 2:
        raise InputError(f"registrations of {source}, seed {seed}", "hold no training samples", "raise their number")
    labels_S = torch.from_numpy(np.array([classes.index(concept) for concept in registrations.concept]))
    batches = -(-len(rows) // settings.batch_size)
    # At least 5 steps long: of a length of 4, a quarter of which rises, torch divides by zero.
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.learning_rate, total_steps=max(5, settings.epochs * batches), pct_start=0.25
    )
    state = {"model": model, "optimiser": optimiser, "schedule": schedule}
    identity = repr((source, seed, asdict(settings), _fingerprint(registrations)))
    curve = _resume(checkpoint, identity, state)

    model.train()
    title = f"{settings.backbone} on {source}, seed {seed}"
    for epoch in progress(range(len(curve), settings.epochs), title, initial=len(curve), total=settings.epochs):
        loss_sum = correct = 0.0
        order = generator(source, seed, "order", epoch).permutation(rows)
        for batch_rows in np.array_split(order, batches):
            clouds = draw_points(
                *(registrations, batch_rows, settings.draw_points, source, seed, "epoch", epoch),
                fewest=settings.fewest_points,
            )
            logits_B_C = model(_on(device, clouds))
            labels_B = labels_S[batch_rows].to(device)
            loss = nn.functional.cross_entropy(logits_B_C, labels_B)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            loss_sum += loss.item() * len(batch_rows)
            correct += float((logits_B_C.argmax(dim=1) == labels_B).sum())
        curve.append(
            {
                "epoch": epoch + 1,
                "learning_rate": schedule.get_last_lr()[0],
                "loss": loss_sum / len(rows),
                "accuracy": correct / len(rows),
            }
        )
        if not np.isfinite(loss_sum):
            raise InputError(title, f"the loss is not finite in epoch {epoch + 1}", "lower encoder.learning_rate")
        _keep(checkpoint, identity, state, curve)
    return model.cpu().eval(), curve


def best_device() -> torch.device:
    """Return the GPU where torch finds one (results then agree with the CPU's within rounding), else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


@torch.inference_mode()
def embed(
    model: Classifier, registrations: Registrations, source: str, seed: int, settings: EncoderSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Return embeddings h (S, d) of all rows, in their order, and the head's logits (S, C) at them; float32.

    h is the mean over ``draws`` draws of N points, each named by sample and draw. One draw uses a quarter of a cloud
    of 2048 points; averaging several halves the classifier's errors on clouds it was not trained on. The logits of a
    linear head at h are their mean over the draws too.
    """
    device, n_points = best_device(), settings.draw_points
    model.to(device).eval()
    batches = np.array_split(np.arange(len(registrations)), -(-len(registrations) // settings.batch_size))
    parts = []
    for rows in progress(batches, f"embeddings of {source}, seed {seed}"):
        draws = [
            draw_points(registrations, rows, n_points, source, seed, "embedding", draw, fewest=settings.fewest_points)
            for draw in range(settings.draws)
        ]
        parts.append(torch.stack([model.encoder(_on(device, clouds)) for clouds in draws]).mean(dim=0))
    h_S_d = torch.cat(parts)
    return h_S_d.cpu().numpy(), model.head(h_S_d).cpu().numpy()


def load_model(weights: Path, settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS) -> Classifier:
    """Load encoder and head as the step ``train`` wrote them, ready for inference.

    Raises:
        InputError: missing, damaged, pickled or another encoder's weights.
    """
    model = make_model(settings, classes)
    remedy = "make them anew with 'python -m gpca train'"
    if not Path(weights).is_file():
        raise InputError(weights, "no such weights", remedy)
    wrong = f"not the weights of backbone '{settings.backbone}'"
    try:
        state = read_tensors(weights)
        require_like(state, model.state_dict(), "network")
    except ValueError as fault:
        raise InputError(weights, f"{wrong}, or damaged ({fault})", remedy) from fault
    except Exception as fault:  # torch raises errors of many kinds for a damaged or foreign file
        raise InputError(weights, wrong, remedy) from fault
    model.load_state_dict(state)
    return model.eval()


class Classifier(nn.Sequential):
    """An encoder and a head over the classes."""

    encoder: nn.Module
    head: nn.Module

    def __init__(self, encoder: nn.Module, head: nn.Module) -> None:
        super().__init__(OrderedDict(encoder=encoder, head=head))


def make_model(settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS) -> Classifier:
    """Return a new encoder with a head over the classes."""
    encoder = make_encoder(settings.backbone, settings.options)
    return Classifier(encoder, _HEADS[settings.head](encoder.embedding_size, len(classes)))


def _two_layers(embedding_size: int, classes: int) -> nn.Module:
    """Return DGCNN's usual kind of head (Wang et al. 2019), of two layers instead of three."""
    hidden = nn.Linear(embedding_size, HIDDEN)
    return nn.Sequential(hidden, nn.BatchNorm1d(HIDDEN), nn.LeakyReLU(0.2), nn.Dropout(0.5), nn.Linear(HIDDEN, classes))


_HEADS: dict[str, Callable[[int, int], nn.Module]] = {"linear": nn.Linear, "two_layer": _two_layers}


def _fingerprint(registrations: Registrations) -> str:
    """Hash what training sees: the clouds, their labels and their splits."""
    digest = hashlib.sha256(registrations.points.tobytes())
    for column in (registrations.offsets, registrations.concept, registrations.split, registrations.sample):
        digest.update(repr(column.tolist()).encode())
    return digest.hexdigest()


def _keep(checkpoint: Path | None, identity: str, state: dict, curve: list[dict]) -> None:
    if checkpoint is None:
        return
    content = {name: part.state_dict() for name, part in state.items()}
    with whole_file(checkpoint) as partial:
        torch.save(content | {"identity": identity, "curve": curve}, partial)


def _resume(checkpoint: Path | None, identity: str, state: dict) -> list[dict]:
    """Load the checkpoint into `state`; an unreadable one or one of other settings or data is left aside."""
    if checkpoint is None or not checkpoint.is_file():
        return []
    try:
        content = read_tensors(checkpoint)
    except Exception:  # whatever a damaged file makes torch raise, training from the start is right
        return []
    if not isinstance(content, dict) or content.get("identity") != identity:
        return []
    for name, part in state.items():
        part.load_state_dict(content[name])
    return content["curve"]
