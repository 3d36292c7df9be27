"""Model files whose GP-CA, settings or names hold what cannot be, through loading and ``explain``."""

import pytest
import torch

from gpca.errors import InputError
from gpca.model.file import Model

from ..hostile import refusal
from .spoiled import EXPLAIN, HUGE, NAN, drop, indefinite, put, spoil


def weight(content):
    return next(tensor for tensor in content["encoder"].values() if tensor.ndim > 1)


def holds_itself(content):
    content["treatments"]["noise"] = [content]
    content["treatments"]["noise"].append(content["treatments"]["noise"])


def variances(content):
    name = next(name for name in content["encoder"] if name.endswith("running_var"))
    content["encoder"][name] *= -1


def every_weight(change):
    return lambda content: content.update(encoder={name: change(w) for name, w in content["encoder"].items()})


CONTENTS = {
    "weights of NaN": lambda content: weight(content).fill_(NAN),
    "one weight of infinity": lambda content: weight(content).view(-1)[3:4].fill_(float("inf")),
    "huge weights": lambda content: weight(content).fill_(1e30),
    "negative running variances": variances,
    "weights of other shapes": every_weight(lambda tensor: tensor[..., :1] if tensor.ndim else tensor),
    "weights of doubles": every_weight(torch.Tensor.double),
    "complex weights": every_weight(lambda tensor: tensor + 1j),
    "no weights": put("encoder", {}),
    "weights of a list": put("encoder", [1, 2]),
    "a tensor without its data": put("gpc/mean", lambda m: torch.zeros(1, dtype=m.dtype).expand(3, 10**12)),
    "a sparse tensor": put("gpc/mean", torch.sparse_coo_tensor(torch.zeros(2, 0), torch.zeros(0), (10**6, 10**6))),
    "a meta tensor": put("gpc/mean", torch.zeros(10**6, 10**6, device="meta")),
    "posterior of NaN": put("gpc/mean", lambda m: m * NAN),
    "posterior of text": put("gpc/mean", "zero"),
    "posterior of other inducing inputs": put("gpc/mean", lambda m: m[:, :-1]),
    "negative variances": put("gpc/covariance", lambda c: -c),
    "a covariance that is not positive definite": put("gpc/covariance", indefinite),
    "a singular covariance": put("gpc/covariance", lambda c: torch.ones_like(c)),
    "a covariance that is not symmetric": put("gpc/covariance", lambda c: c.triu()),
    "a covariance of whole numbers": put("gpc/covariance", lambda c: torch.eye(c.shape[-1]).expand_as(c).long()),
    "a seed named by text": put("gpc/axes", "real"),
    "a seed named by lists": put("gpc/axes", [["real"], 0]),
    "covariance of another shape": put("gpc/covariance", lambda c: c[:, :1]),
    "inducing inputs of another encoder": put("gpc/inducing", lambda z: z[:, :-1]),
    "labels of another encoder": put("gpc/labelled", lambda z: z[:, :-1]),
    "fewer labels than inputs": put("gpc/targets", lambda t: t[:-1]),
    "labels of no concept": put("gpc/targets", lambda t: t + 7),
    "negative labels": put("gpc/targets", lambda t: t - 1),
    "labels of halves": put("gpc/targets", lambda t: t + 0.5),
    "scales of nothing": put("gpc/scaler_scale", lambda s: 0 * s),
    "negative scales": put("gpc/scaler_scale", lambda s: -s),
    "a kernel of NaN": lambda content: content["gpc"]["kernel"]["raw_outputscale"].fill_(NAN),
    "a kernel of other bounds": put("gpc/kernel/raw_outputscale_constraint.lower_bound", lambda b: b + 1),
    "another kernel": put("gpc/settings/kernel", "polynomial"),
    "an unknown kernel": put("gpc/settings/kernel", "magic"),
    "one concept": put("gpc/classes", ["noise"]),
    "a concept twice": put("gpc/classes", ["noise", "noise", "pose"]),
    "concepts of numbers": put("gpc/classes", [1, 2, 3]),
    "concepts of another classifier": put("gpc/classes", ["red", "green", "blue"]),
    "concepts in another order": put("gpc/classes", ["overlap", "noise", "pose"]),
    "one concept more": put("gpc/classes", lambda classes: [*classes, "geometry"]),
    "a concept of two lines": put("gpc/classes", ["noise", "pose\nTraceback", "overlap"]),
    "draws of 1e9": put("gpc/settings/draws", HUGE),
    "no draws": put("gpc/settings/draws", 0),
    "draws of NaN": put("gpc/settings/draws", NAN),
    "draws of the encoder of 1e9": put("encoder_settings/draws", HUGE),
    "1e9 points drawn": put("encoder_settings/points", HUGE),
    "negative points drawn": put("encoder_settings/points", -512),
    "points drawn of text": put("encoder_settings/points", "many"),
    "an unknown backbone": put("encoder_settings/backbone", "os.system"),
    "an unknown option": put("encoder_settings/options/magic", 1),
    "a width of 1e9": put("encoder_settings/options/point_features", HUGE),
    "neighbours of 1e9": put("encoder_settings/options/k", HUGE),
    "negative neighbours": put("encoder_settings/options/k", -8),
    "a negative distance": put("icp/correspondence_distance", -0.1),
    "a distance of NaN": put("icp/correspondence_distance", NAN),
    "1e9 iterations": put("icp/max_iterations", HUGE),
    "an unknown method": put("icp/method", "magic"),
    "clouds of 1e12 points": put("points", 10**12),
    "clouds of no points": put("points", 0),
    "clouds of half a point": put("points", 256.5),
    "clouds of true points": put("points", True),
    "a threshold of NaN": put("thresholds/uncertain", NAN),
    "a negative threshold": put("thresholds/uncertain", -1.0),
    "a share above 1": put("thresholds/dominant", 7.0),
    "no attempts": put("thresholds/attempts", 0),
    "attempts without end": put("thresholds/attempts", 10**12),
    "treatments of a list": put("treatments", ["denoise"]),
    "an action that no robot has": put("treatments/noise", "rm -rf"),
    "an action that is no treatment": put("treatments/noise", "nothing"),
    "an empty action": put("treatments/noise", ""),
    "a treatment of no concept": put("treatments/geometry", "denoise"),
    "no treatments": put("treatments", {}),
    "a concept without a treatment": drop("treatments/pose"),
    "one action for two concepts": put("treatments/noise", "new_view"),
    "an action of a number": put("treatments/noise", 5),
    "a list that contains itself": holds_itself,
    "a title of two lines": put("title", "Mugs\nTraceback"),
    "a title of a number": put("title", 7),
    "a doubtful stand-in": put("stand_in", "no"),
    "ranges of nothing": put("familiar", {}),
    "ranges of a list": put("familiar", [1, 2]),
    "a range of text": put("familiar/size", ["small", "large"]),
    "a range that falls": put("familiar/depth", [1.0, 0.5]),
    "a range of NaN": put("familiar/closure", [NAN, 1.0]),
    "a range of three": put("familiar/size", [0.1, 0.5, 1.0]),
    "no settings": drop("encoder_settings"),
    "no thresholds": drop("thresholds"),
    "no title": drop("title"),
    "another version": put("version", 4),
    "another format": put("format", "a model"),
}  # fmt: skip


TO_EXPLAIN = [  # what would take the time, the memory or the terminal of who explains
    "one weight of infinity", "a tensor without its data", "draws of 1e9", "draws of the encoder of 1e9",
    "1e9 points drawn", "a width of 1e9", "neighbours of 1e9", "a negative distance", "1e9 iterations",
    "a title of two lines", "a list that contains itself",
]  # fmt: skip


@pytest.mark.parametrize("fault", CONTENTS)
def test_a_model_with_what_cannot_be_is_not_loaded(fault, folder):
    spoil(folder / "model.pt", CONTENTS[fault])
    with pytest.raises(InputError, match=r"model\.pt: is .*; make one with"):
        Model.load(folder / "model.pt")


@pytest.mark.parametrize("fault", TO_EXPLAIN)
def test_a_model_that_would_hang_or_fill_the_memory_is_refused(fault, folder):
    spoil(folder / "model.pt", CONTENTS[fault])
    refusal(EXPLAIN, folder, "model.pt", "make one with")
