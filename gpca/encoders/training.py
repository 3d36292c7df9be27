"""Training an encoder with a head over the concepts (paper Sec. III-A), its files, and the embeddings."""

import hashlib
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.errors import InputError
from gpca.io.arrays import require_numbers
from gpca.io.files import Axes, require_axes, require_file, whole_file
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.portable import Adam, one_cycle
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of

HIDDEN = 256  # units of a head of two layers
RISING = 0.25  # share of the steps in which the one-cycle learning rate rises
Draw = Callable[..., Any]  # as :func:`draw_points`: the encoder's input for some rows


def draw_points(
    registrations: Registrations, rows: np.ndarray, n_points: int, *axes: object, fewest: int | None = None
) -> torch.Tensor | list[torch.Tensor]:
    """Draw `n_points` random points of each row's aligned cloud, (B, N, 3) float32; small clouds repeat points.

    With `fewest`, return B clouds of a random number of points from `fewest` to `n_points`, or all of a smaller one.
    """
    clouds = []
    for row in rows:
        points = registrations.cloud(row)
        random = generator(*axes, registrations.split[row], registrations.sample[row])
        count = n_points if fewest is None else min(int(random.integers(fewest, n_points + 1)), len(points))
        chosen = random.choice(len(points), count, replace=len(points) < count, shuffle=False)
        clouds.append(torch.from_numpy(points[chosen].astype(np.float32)))
    return torch.stack(clouds) if fewest is None else clouds


class Classifier(nn.Module):
    """An encoder and a head over the classes."""

    def __init__(self, encoder: nn.Module, head: nn.Module) -> None:
        super().__init__()
        self.encoder, self.head = encoder, head

    def forward(self, clouds: Any) -> torch.Tensor:
        return self.head(embeddings_by(self.encoder, clouds))


def embeddings_by(encoder: Any, clouds: Any) -> torch.Tensor:
    """Return h (B, d) of a batch; InputError unless the encoder, perhaps one from outside, gives this shape."""
    h_B_d, count = encoder(clouds), len(clouds)
    if isinstance(h_B_d, torch.Tensor):
        count = count if isinstance(clouds, torch.Tensor) else len(h_B_d)  # else of several sizes, by one of the suite
        words = f"{h_B_d.dtype} of shape {[*h_B_d.shape]}"
    else:
        words = f"a {type(h_B_d).__name__}"
    if words != (wanted := f"torch.float32 of shape {[count, encoder.embedding_size]}"):
        raise InputError(f"encoder {type(encoder).__name__}", f"returns {words}", f"return {wanted}")
    return h_B_d


def make_model(
    settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS, encoder: Any | None = None
) -> Classifier:
    """Return an encoder, by default one of the registry, with a new head of one layer, or of two as DGCNN's last."""
    encoder = encoder or make_encoder(settings.backbone, settings.options)
    d, n_classes = encoder.embedding_size, len(classes)
    if settings.head == "linear":
        return Classifier(encoder, nn.Linear(d, n_classes))
    first, norm = nn.Linear(d, HIDDEN), nn.BatchNorm1d(HIDDEN)
    head = nn.Sequential(first, norm, nn.LeakyReLU(0.2), nn.Dropout(0.5), nn.Linear(HIDDEN, n_classes))
    return Classifier(encoder, head)


def train_encoder(
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    checkpoint: Path | None = None,
    classes: tuple[str, ...] = CONCEPTS,
    start: Mapping[str, torch.Tensor] | None = None,
    group_S: np.ndarray | None = None,
    make: Callable[[], nn.Module] | None = None,
    draw: Draw = draw_points,
) -> tuple[Classifier, list[dict[str, float]]]:
    """Train on the rows of split ``train``; a share of their groups can be held out for validation.

    With validation, the weights are those of the epoch with the smallest validation loss, and training may end early.
    Training resumes from a checkpoint of the same settings and data, from random weights or those of `start`. Rows of
    one group (S,), by default of one object, are held out together. Return the model, and the curve, epoch by epoch.
    """
    torch.manual_seed(seed_of(source, seed, "encoder", settings.backbone))
    model = make_model(settings, classes, make and make()).to(best_device())
    if start is not None:
        model.load_state_dict(start)
    rows, held_out = _held_out(registrations, source, seed, settings.validation_share, group_S)
    if len(rows) < 2:
        raise InputError(f"registrations of {source}, seed {seed}", "have no training samples", "increase their number")
    targets_S = torch.from_numpy(np.array([classes.index(name) for name in registrations.concept]))

    def predict(batch: np.ndarray, *axes: object) -> tuple[torch.Tensor, torch.Tensor]:
        clouds = _drawn(draw, settings, registrations, batch, source, seed, *axes)
        return model(clouds), targets_S[batch].to(best_device())

    training = _Training(model, predict, rows, settings, (source, seed))
    best = deepcopy(model) if len(held_out) else model
    state = training.state | ({"best": best} if len(held_out) else {})
    identity = repr((source, seed, asdict(settings), *_fingerprints(registrations, start or {})))
    curve = _resume(checkpoint, identity, state)

    epochs = range(len(curve), settings.epochs)
    for epoch in progress(epochs, training.title, initial=len(curve), total=settings.epochs):
        losses = [record["validation_loss"] for record in curve if "validation_loss" in record]
        if settings.patience and losses and len(losses) - 1 - int(np.argmin(losses)) >= settings.patience:
            break
        curve.append({"epoch": epoch + 1, **training.run_epoch(epoch)})
        if len(held_out):
            curve[-1] |= training.validate(held_out)
            if curve[-1]["validation_loss"] == min(record["validation_loss"] for record in curve):
                best.load_state_dict(model.state_dict())
        if checkpoint is not None:
            content = {name: part.state_dict() for name, part in state.items()}
            write_tensors(checkpoint, content | {"identity": identity, "curve": curve})
    return best.cpu().eval(), curve


class _Training:
    """A model with its optimizer and schedule, and its training rows."""

    def __init__(
        self, model: Classifier, predict: Callable, rows: np.ndarray, settings: EncoderSettings, axes: Axes
    ) -> None:
        self._model, self._predict, self._rows = model, predict, rows
        self._axes, self._settings = axes, settings
        self._batches = -(-len(rows) // settings.batch_size)
        self._optimizer = Adam(model.parameters(), settings.learning_rate, settings.weight_decay)
        self.state: dict[str, Any] = {"model": model, "optimizer": self._optimizer}
        self.title = f"{settings.backbone} on {axes[0]}, seed {axes[1]}"

    def run_epoch(self, epoch: int) -> dict[str, float]:
        """Train on every row once, in the order of this epoch; return the last learning rate, loss and accuracy."""
        self._model.train()
        torch.manual_seed(seed_of(*self._axes, "dropout", epoch))  # the same in a resumed training
        loss_sum = correct = 0.0
        order = generator(*self._axes, "order", epoch).permutation(self._rows)
        for batch, batch_rows in enumerate(np.array_split(order, self._batches)):
            self._schedule(epoch * self._batches + batch)
            outputs_B_C, targets_B = self._predict(batch_rows, "epoch", epoch)
            loss = nn.functional.cross_entropy(outputs_B_C, targets_B)
            self._optimizer.zero_grad()
            loss.backward()
            self._optimizer.step()
            loss_sum += loss.item() * len(batch_rows)
            correct += float((outputs_B_C.argmax(dim=1) == targets_B).sum())
        if not np.isfinite(loss_sum):
            raise InputError(self.title, f"the loss is not finite in epoch {epoch + 1}", "lower encoder.learning_rate")
        self._schedule((epoch + 1) * self._batches)
        n, rate = len(self._rows), self._optimizer.learning_rate
        return {"learning_rate": rate, "loss": loss_sum / n, "accuracy": correct / n}

    def _schedule(self, step: int) -> None:
        steps = max(5, self._settings.epochs * self._batches)  # a quarter of 4 would be one, a rise of no length
        rate_and_beta1 = one_cycle(step, steps, self._settings.learning_rate, RISING)
        self._optimizer.learning_rate, self._optimizer.beta1 = rate_and_beta1

    @torch.inference_mode()
    def validate(self, rows: np.ndarray) -> dict[str, float]:
        """Return loss and accuracy on one draw from each cloud, the same in every epoch."""
        self._model.eval()
        batches = np.array_split(rows, -(-len(rows) // self._settings.batch_size))
        parts = [self._predict(batch_rows, "validation") for batch_rows in batches]
        outputs_R_C, targets_R = (torch.cat(part).cpu() for part in zip(*parts, strict=True))
        correct = float((outputs_R_C.argmax(dim=1) == targets_R).sum())
        loss = nn.functional.cross_entropy(outputs_R_C, targets_R).item()
        return {"validation_loss": loss, "validation_accuracy": correct / len(rows)}


def _held_out(
    registrations: Registrations, source: str, seed: int, share: float, group_S: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Split the rows of ``train`` into those to train on and those to validate on, by whole groups."""
    rows = registrations.rows("train")
    if not share:
        return rows, rows[:0]
    # Samples 3t, 3t + 1 and 3t + 2 show one object under the three concepts.
    group_R = (registrations.sample // len(CONCEPTS) if group_S is None else group_S)[rows]
    groups = generator(source, seed, "validation").permutation(np.unique(group_R))
    is_held_out = np.isin(group_R, groups[: max(1, round(share * len(groups)))])
    return rows[~is_held_out], rows[is_held_out]


def _drawn(draw: Draw, settings: EncoderSettings, registrations: Registrations, rows: np.ndarray, *axes: object) -> Any:
    clouds = draw(registrations, rows, settings.draw_points, *axes, fewest=settings.fewest_points)
    device = best_device()
    return clouds.to(device) if isinstance(clouds, torch.Tensor) else [cloud.to(device) for cloud in clouds]


def best_device() -> torch.device:
    """Return the GPU if torch finds one (its results agree with the CPU's within rounding), else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def _fingerprints(registrations: Registrations, weights: Mapping[str, torch.Tensor]) -> tuple[str, str]:
    samples, parts = hashlib.sha256(registrations.points.tobytes()), hashlib.sha256()
    for column in (registrations.offsets, registrations.concept, registrations.split, registrations.sample):
        samples.update(repr(column.tolist()).encode())
    for name, tensor in weights.items():
        parts.update(name.encode() + tensor.numpy().tobytes())
    return samples.hexdigest(), parts.hexdigest()


def _resume(checkpoint: Path | None, identity: str, state: dict) -> list[dict]:
    """Load the checkpoint into `state` and return its curve; an unreadable or foreign one is ignored."""
    if checkpoint is None or not checkpoint.is_file():
        return []
    try:
        content = torch.load(checkpoint, weights_only=True, map_location="cpu")
    except Exception:  # whatever a damaged file makes torch raise, training from the start is right
        return []
    if not isinstance(content, dict) or content.get("identity") != identity or not set(state) <= set(content):
        return []
    for name, part in state.items():
        part.load_state_dict(content[name])
    return content["curve"]


def write_tensors(path: str | Path, content: object) -> None:
    # Given a path, torch.save writes its name into the file; here that would be the temporary one.
    with whole_file(path) as partial, partial.open("wb") as file:
        torch.save(content, file)


def write_weights(path: str | Path, model: Classifier, axes: Axes) -> None:
    """Write a model for :func:`load_model`; `axes` are the source and the seed of the training samples."""
    write_tensors(path, {"weights": model.state_dict(), "source": axes[0], "seed": axes[1]})


def load_model(
    path: Path, settings: EncoderSettings, classes: tuple[str, ...] = CONCEPTS, axes: Axes | None = None
) -> Classifier:
    """Load encoder and head for inference; source and seed of their samples have to be `axes`."""
    model = make_model(settings, classes)
    remedy = "regenerate them with Snakemake"
    require_file(path, "no such weights", remedy)
    try:
        content = torch.load(path, weights_only=True, map_location="cpu")
        trained_on = content["source"], content["seed"]
        model.load_state_dict(content["weights"])
    except Exception as fault:  # torch raises errors of many kinds for a damaged or foreign file
        raise InputError(path, f"not the weights of backbone '{settings.backbone}', or damaged", remedy) from fault
    require_axes(path, trained_on, axes)
    return model.eval()


def embedding_by(
    model: Classifier, seed: int, settings: EncoderSettings
) -> Callable[[Registrations, str], tuple[np.ndarray, np.ndarray]]:
    """The function that embeds registrations, given the name of their source, by a trained encoder."""
    return lambda registrations, source: embed(model, registrations, source, seed, settings)


@torch.inference_mode()
def embed(
    model: Classifier,
    registrations: Registrations,
    source: str,
    seed: int,
    settings: EncoderSettings,
    draw: Draw = draw_points,
) -> tuple[np.ndarray, np.ndarray]:
    """Return embeddings h (S, d) of all rows, the mean over draws of N points, and the head's logits (S, C)."""
    model.to(best_device()).eval()
    batches = np.array_split(np.arange(len(registrations)), -(-len(registrations) // settings.batch_size))
    parts = []
    for rows in progress(batches, f"embeddings of {source}, seed {seed}"):
        axes = [(source, seed, "embedding", number) for number in range(settings.draws)]
        draws = [embeddings_by(model.encoder, _drawn(draw, settings, registrations, rows, *names)) for names in axes]
        parts.append(torch.stack(draws).mean(dim=0))
    h_S_d = torch.cat(parts)
    h, logits = h_S_d.cpu().numpy(), model.head(h_S_d).cpu().numpy()
    return require_numbers(h, h.shape, f"encoder {type(model.encoder).__name__}: its embeddings"), logits
