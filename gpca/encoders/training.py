"""Training an encoder with a head over the concepts (paper Sec. III-A); GP-CA reads the encoder, a rival the head.

Each epoch sees a fresh random subset of every cloud's points. There is no other augmentation: rotations and shifts
would erase the pose concept, jitter the noise concept, crops the overlap concept.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from gpca.encoders.registry import make_encoder
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.tensor_file import fingerprint, fingerprint_of, keep, resume
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
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


@dataclass(frozen=True)
class TrainingTask:
    """The task of an encoder: its view of a registration, and the classes of its head.

    Attributes:
        classes: the names that ``concept`` may have.
        make: makes the encoder, where it is none of the registry.
        draw: what the encoder sees of a row, anew in every epoch.
    """

    classes: tuple[str, ...] = CONCEPTS
    make: Callable[[], nn.Module] | None = None
    draw: Draw = draw_points

    def model(self, settings: EncoderSettings) -> Classifier:
        """Return a new encoder with its head."""
        return with_head(self.make(), settings, self.classes) if self.make else make_model(settings, self.classes)

    def targets(self, registrations: Registrations) -> torch.Tensor:
        """Return the number of each row's class (S,)."""
        return torch.from_numpy(np.array([self.classes.index(concept) for concept in registrations.concept]))


def train_encoder(
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    checkpoint: Path | None = None,
    task: TrainingTask = TrainingTask(),
    start: Mapping[str, torch.Tensor] | None = None,
    group_S: np.ndarray | None = None,
) -> tuple[Classifier, list[dict[str, float]]]:
    """Train on the rows of split ``train``, of which a share of the groups can be held out for validation.

    With validation, the weights are those of the epoch with the smallest validation loss, and training may end early.

    Args:
        checkpoint: where the state after every epoch is kept; if it is there, of the same settings and data, training
            continues from it and ends with the same weights as an unbroken run.
        start: the weights to start from; random ones where None.
        group_S: (S,) of each row; rows of one group are held out together. By default rows of one object that were
            made one after the other.

    Returns:
        the model (``model.encoder``, ``model.head``), and the training curve: epoch, learning_rate, loss, accuracy,
        and validation_loss and validation_accuracy where samples are held out.
    """
    torch.manual_seed(seed_of(source, seed, "encoder", settings.backbone))
    model = task.model(settings).to(best_device())
    if start is not None:
        model.load_state_dict(start)
    rows, held_out = _held_out(registrations, source, seed, settings.validation_share, group_S)
    if len(rows) < 2:
        raise InputError(f"registrations of {source}, seed {seed}", "have no training samples", "increase their number")
    training = _Training(model, registrations, rows, task, (source, seed), settings)
    best = deepcopy(model) if len(held_out) else model
    state = training.state | ({"best": best} if len(held_out) else {})
    data = (fingerprint(registrations), fingerprint_of(start))
    identity = repr((source, seed, asdict(settings), *data))
    curve = resume(checkpoint, identity, state)

    epochs = range(len(curve), settings.epochs)
    for epoch in progress(epochs, training.title, initial=len(curve), total=settings.epochs):
        if _is_settled(curve, settings.patience):
            break
        curve.append({"epoch": epoch + 1, **training.run_epoch(epoch)})
        if len(held_out):
            curve[-1] |= training.validate(held_out)
            if curve[-1]["validation_loss"] == min(record["validation_loss"] for record in curve):
                best.load_state_dict(model.state_dict())
        keep(checkpoint, identity, state, curve)
    return best.cpu().eval(), curve


class _Training:
    """A model with its optimizer and schedule, and the rows on which it is trained."""

    def __init__(
        self,
        model: Classifier,
        registrations: Registrations,
        rows: np.ndarray,
        task: TrainingTask,
        axes: tuple[str, int],
        settings: EncoderSettings,
    ) -> None:
        self._model, self._registrations, self._rows = model, registrations, rows
        self._axes, self._settings, self._draw = axes, settings, task.draw
        self._targets_S = task.targets(registrations)
        self._batches = -(-len(rows) // settings.batch_size)
        rate = settings.learning_rate
        steps = max(5, settings.epochs * self._batches)  # a quarter of 4 would be one step, a rise of no length
        # Fused, since the plain form takes torch.sqrt, whose last bit depends on the processor's vendor.
        self._optimizer = torch.optim.AdamW(model.parameters(), rate, weight_decay=settings.weight_decay, fused=True)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(self._optimizer, rate, steps, pct_start=RISING)
        self.state = {"model": model, "optimizer": self._optimizer, "schedule": self._schedule}
        self.title = f"{settings.backbone} on {axes[0]}, seed {axes[1]}"

    def run_epoch(self, epoch: int) -> dict[str, float]:
        """Train on every row once, in an order of this epoch; return the last learning rate, loss and accuracy."""
        self._model.train()
        torch.manual_seed(seed_of(*self._axes, "dropout", epoch))  # whether or not it is the first epoch of a process
        loss_sum = correct = 0.0
        order = generator(*self._axes, "order", epoch).permutation(self._rows)
        for batch_rows in np.array_split(order, self._batches):
            outputs_B_C, targets_B = self._predict(batch_rows, "epoch", epoch)
            loss = nn.functional.cross_entropy(outputs_B_C, targets_B)
            if (penalty := getattr(self._model.encoder, "penalty", None)) is not None:
                loss = loss + penalty
            self._optimizer.zero_grad()
            loss.backward()
            self._optimizer.step()
            self._schedule.step()
            loss_sum += loss.item() * len(batch_rows)
            correct += _hits(outputs_B_C, targets_B)
        if not np.isfinite(loss_sum):
            raise InputError(self.title, f"the loss is not finite in epoch {epoch + 1}", "lower encoder.learning_rate")
        means = {"loss": loss_sum / len(self._rows), "accuracy": correct / len(self._rows)}
        return {"learning_rate": self._optimizer.param_groups[0]["lr"], **means}

    @torch.inference_mode()
    def validate(self, rows: np.ndarray) -> dict[str, float]:
        """Return loss and accuracy on rows, of one draw from each cloud that is the same in every epoch."""
        self._model.eval()
        batches = np.array_split(rows, -(-len(rows) // self._settings.batch_size))
        parts = [self._predict(batch_rows, "validation") for batch_rows in batches]
        outputs_R_C, targets_R = (torch.cat(part).cpu() for part in zip(*parts, strict=True))
        loss = nn.functional.cross_entropy(outputs_R_C, targets_R).item()
        return {"validation_loss": loss, "validation_accuracy": _hits(outputs_R_C, targets_R) / len(rows)}

    def _predict(self, rows: np.ndarray, *axes: object) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the head's outputs (B, C) for a draw from each row, named by the axes, and the rows' targets."""
        points, fewest = self._settings.draw_points, self._settings.fewest_points
        clouds = self._draw(self._registrations, rows, points, *self._axes, *axes, fewest=fewest)
        device = best_device()
        return self._model(_on(device, clouds)), self._targets_S[rows].to(device)


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


def _hits(outputs_B_C: torch.Tensor, targets_B: torch.Tensor) -> float:
    """Return how many classes are right."""
    return float((outputs_B_C.argmax(dim=1) == targets_B).sum())


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
