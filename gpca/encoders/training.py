"""Training an encoder with a head over the concepts (paper Sec. III-A); GP-CA reads the encoder, a rival the head.

Each epoch sees a fresh random subset of every cloud's points. There is no other augmentation: rotations and shifts
would erase the pose concept, jitter the noise concept, crops the overlap concept.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from gpca.encoders.checkpoint import fingerprint, fingerprint_of, keep, resume
from gpca.encoders.registry import make_encoder
from gpca.encoders.settings import EncoderSettings
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.progress import progress
from gpca.seeds import generator, seed_of

HIDDEN = 256  # units of a head of two layers
RISING = 0.25  # share of the steps in which the learning rate of the one cycle rises
Draw = Callable[..., Any]  # as :func:`draw_points`, what an encoder sees of some rows


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


def _on(device: torch.device, clouds: Any) -> Any:
    return clouds.to(device) if isinstance(clouds, torch.Tensor) else [cloud.to(device) for cloud in clouds]


def train_encoder(
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    checkpoint: Path | None = None,
    classes: tuple[str, ...] = CONCEPTS,
    targets_S_C: np.ndarray | None = None,
    start: Mapping[str, torch.Tensor] | None = None,
    group_S: np.ndarray | None = None,
    make: Callable[[], nn.Module] | None = None,
    draw: Draw = draw_points,
) -> tuple[Classifier, list[dict[str, float]]]:
    """Train on the rows of split ``train``, of which a share of the groups can be held out for validation.

    With validation, the weights are those of the epoch with the smallest validation loss, and training may end early.

    Args:
        classes: what ``concept`` names.
        targets_S_C: numbers that the head learns to predict, by least squares, in the place of the concepts; `classes`
            then names its columns, and the curve has no accuracy.
        start: the weights to start from; random ones where None.
        group_S: (S,) of each row; rows of one group are held out together. By default rows of one object that were
            made one after the other.
        make: makes the encoder, where it is none of the registry.
        draw: what the encoder sees of a row, anew in every epoch.
        checkpoint: where the state after every epoch is kept; if it is there, of the same settings and data, training
            continues from it and ends with the same weights as an unbroken run.

    Returns:
        the model (``model.encoder``, ``model.head``), and the training curve: epoch, learning_rate, loss, accuracy,
        and validation_loss and validation_accuracy where samples are held out.
    """
    torch.manual_seed(seed_of(source, seed, "encoder", settings.backbone))
    device = best_device()
    model = (with_head(make(), settings, classes) if make else make_model(settings, classes)).to(device)
    if start is not None:
        model.load_state_dict(start)
    # Fused, since the plain form takes torch.sqrt, whose last bit depends on the processor's vendor.
    rate = settings.learning_rate
    optimizer = torch.optim.AdamW(model.parameters(), rate, weight_decay=settings.weight_decay, fused=True)
    rows, held_out = _held_out(registrations, source, seed, settings.validation_share, group_S)
    if len(rows) < 2:
        raise InputError(f"registrations of {source}, seed {seed}", "have no training samples", "increase their number")
    if targets_S_C is None:
        wanted_S = torch.from_numpy(np.array([classes.index(concept) for concept in registrations.concept]))
    else:
        wanted_S = torch.from_numpy(targets_S_C.astype(np.float32))
    batches = -(-len(rows) // settings.batch_size)
    steps = max(5, settings.epochs * batches)  # a quarter of 4 would be one step, a rise of no length
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps, pct_start=RISING)
    best = deepcopy(model) if len(held_out) else model
    state = {"model": model, "optimizer": optimizer, "schedule": schedule} | ({"best": best} if len(held_out) else {})
    identity = repr((source, seed, asdict(settings), fingerprint(registrations, targets_S_C), fingerprint_of(start)))
    curve = resume(checkpoint, identity, state)

    title = f"{settings.backbone} on {source}, seed {seed}"
    for epoch in progress(range(len(curve), settings.epochs), title, initial=len(curve), total=settings.epochs):
        if _is_settled(curve, settings.patience):
            break
        model.train()
        torch.manual_seed(seed_of(source, seed, "dropout", epoch))  # whether or not it is the first epoch of a process
        loss_sum = correct = 0.0
        order = generator(source, seed, "order", epoch).permutation(rows)
        for batch_rows in np.array_split(order, batches):
            clouds = draw(
                *(registrations, batch_rows, settings.draw_points, source, seed, "epoch", epoch),
                fewest=settings.fewest_points,
            )
            logits_B_C = model(_on(device, clouds))
            wanted_B = wanted_S[batch_rows].to(device)
            loss = _loss_of(wanted_B)(logits_B_C, wanted_B)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            loss_sum += loss.item() * len(batch_rows)
            correct += _hits(logits_B_C, wanted_B)
        curve.append(
            {
                "epoch": epoch + 1,
                "learning_rate": optimizer.param_groups[0]["lr"],
                "loss": loss_sum / len(rows),
                "accuracy": correct / len(rows),
            }
        )
        if not np.isfinite(loss_sum):
            raise InputError(title, f"the loss is not finite in epoch {epoch + 1}", "lower encoder.learning_rate")
        if len(held_out):
            curve[-1] |= _validate(model, registrations, held_out, wanted_S, source, seed, settings, draw)
            if curve[-1]["validation_loss"] == min(record["validation_loss"] for record in curve):
                best.load_state_dict(model.state_dict())
        keep(checkpoint, identity, state, curve)
    return best.cpu().eval(), curve


def _held_out(
    registrations: Registrations, source: str, seed: int, share: float, group_S: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows to train on and those to validate on, whole groups of the split ``train``."""
    rows = registrations.rows("train")
    if not share:
        return rows, rows[:0]
    # Samples 3t, 3t + 1 and 3t + 2 show one object under the concepts in turn.
    group_R = (registrations.sample // len(CONCEPTS) if group_S is None else group_S)[rows]
    groups = generator(source, seed, "validation").permutation(np.unique(group_R))
    is_held_out = np.isin(group_R, groups[: max(1, round(share * len(groups)))])
    return rows[~is_held_out], rows[is_held_out]


@torch.inference_mode()
def _validate(
    model: Classifier,
    registrations: Registrations,
    rows: np.ndarray,
    wanted_S: torch.Tensor,
    source: str,
    seed: int,
    settings: EncoderSettings,
    draw: Draw,
) -> dict[str, float]:
    """Return loss and accuracy on rows, of one draw from each cloud that is the same in every epoch.

    Args:
        wanted_S: each row's class, or the numbers that are to be predicted, which have no accuracy.
    """
    model.eval()
    parts = []
    for batch_rows in np.array_split(rows, -(-len(rows) // settings.batch_size)):
        clouds = draw(
            registrations, batch_rows, settings.draw_points, source, seed, "validation", fewest=settings.fewest_points
        )
        parts.append(model(_on(next(model.parameters()).device, clouds)).cpu())
    logits_R_C, wanted_R = torch.cat(parts), wanted_S[rows]
    loss = _loss_of(wanted_R)(logits_R_C, wanted_R).item()
    return {"validation_loss": loss, "validation_accuracy": _hits(logits_R_C, wanted_R) / len(rows)}


def _loss_of(wanted: torch.Tensor) -> Callable[[torch.Tensor, torch.Tensor], torch.Tensor]:
    return nn.functional.mse_loss if wanted.is_floating_point() else nn.functional.cross_entropy


def _hits(logits_B_C: torch.Tensor, wanted_B: torch.Tensor) -> float:
    """Return how many classes are right; NaN of numbers."""
    return np.nan if wanted_B.is_floating_point() else float((logits_B_C.argmax(dim=1) == wanted_B).sum())


def _is_settled(curve: list[dict[str, float]], patience: int | None) -> bool:
    """Return whether the validation loss has had no new minimum for so many epochs."""
    losses = [record["validation_loss"] for record in curve if "validation_loss" in record]
    return bool(patience and losses and len(losses) - 1 - int(np.argmin(losses)) >= patience)


def best_device() -> torch.device:
    """Return the GPU where torch finds one (results then agree with the CPU's within rounding), else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


@torch.inference_mode()
def embed(
    model: Classifier,
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    draw: Draw = draw_points,
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
            draw(registrations, rows, n_points, source, seed, "embedding", number, fewest=settings.fewest_points)
            for number in range(settings.draws)
        ]
        parts.append(torch.stack([model.encoder(_on(device, clouds)) for clouds in draws]).mean(dim=0))
    h_S_d = torch.cat(parts)
    return h_S_d.cpu().numpy(), model.head(h_S_d).cpu().numpy()


class Classifier(nn.Sequential):
    """An encoder and a head over the classes."""

    encoder: nn.Module
    head: nn.Module

    def __init__(self, encoder: nn.Module, head: nn.Module) -> None:
        super().__init__(OrderedDict(encoder=encoder, head=head))


def make_model(settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS) -> Classifier:
    """Return a new encoder with a head over the classes."""
    return with_head(make_encoder(settings.backbone, settings.options), settings, classes)


def with_head(encoder: Any, settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS) -> Classifier:
    """Return an encoder with a new head over the classes."""
    return Classifier(encoder, _HEADS[settings.head](encoder.embedding_size, len(classes)))


def _two_layers(embedding_size: int, classes: int) -> nn.Module:
    """Return DGCNN's usual kind of head (Wang et al. 2019), of two layers instead of three."""
    hidden = nn.Linear(embedding_size, HIDDEN)
    return nn.Sequential(hidden, nn.BatchNorm1d(HIDDEN), nn.LeakyReLU(0.2), nn.Dropout(0.5), nn.Linear(HIDDEN, classes))


_HEADS: dict[str, Callable[[int, int], nn.Module]] = {"linear": nn.Linear, "two_layer": _two_layers}
