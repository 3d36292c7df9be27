"""Model and weight files that are damaged, or hold what cannot be, through ``explain`` and ``embed``."""

import functools
import zipfile

import numpy as np
import pytest
import torch
import trimesh

from gpca.errors import InputError
from gpca.model.file import Model

from ..hostile import refusal

EXPLAIN = ["explain", "ball.ply", "ball.ply", "--unit", "mm", "--model", "model.pt"]
BALL = trimesh.creation.icosphere(3, radius=50)


@pytest.fixture(scope="module")
def saved(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "model.pt"
    model.save(path)
    return path


@pytest.fixture
def folder(saved, tmp_path):
    (tmp_path / "model.pt").write_bytes(saved.read_bytes())
    BALL.export(tmp_path / "ball.ply")
    return tmp_path


def part(content, path):
    """The mapping that a path of names ends in, and its last name."""
    *parents, last = path.split("/")
    return functools.reduce(lambda inner, name: inner[name], parents, content), last


def weight(content):
    return next(tensor for tensor in content["encoder"].values() if tensor.ndim > 1)


def put(path, value):
    def spoil(content):
        inner, last = part(content, path)
        inner[last] = value(inner[last]) if callable(value) else value

    return spoil


def drop(path):
    def spoil(content):
        inner, last = part(content, path)
        del inner[last]

    return spoil


def holds_itself(content):
    content["treatments"]["noise"] = [content]
    content["treatments"]["noise"].append(content["treatments"]["noise"])


def variances(content):
    name = next(name for name in content["encoder"] if name.endswith("running_var"))
    content["encoder"][name] *= -1


def every_weight(change):
    return lambda content: content.update(encoder={name: change(w) for name, w in content["encoder"].items()})


NAN, HUGE = float("nan"), 10**9
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
    "a concept of two lines": put("gpc/classes", ["noise", "pose\nTraceback", "overlap"]),
    "draws of 1e9": put("gpc/settings/draws", HUGE),
    "no draws": put("gpc/settings/draws", 0),
    "draws of NaN": put("gpc/settings/draws", NAN),
    "a threshold of failure of NaN": put("diagnoser/threshold", NAN),
    "a threshold of text": put("diagnoser/threshold", "0.5"),
    "errors of other descriptors": put("diagnoser/error_weights", lambda w: w[:-1]),
    "quantiles of other descriptors": put("diagnoser/classifier/quantiles", lambda q: q[:, :-1]),
    "quantiles that fall": put("diagnoser/classifier/quantiles", lambda q: q.flip(0)),
    "1e9 starts": put("diagnoser/runs/starts", HUGE),
    "starts of text": put("diagnoser/runs/starts", "many"),
    "1e9 restarts": put("diagnoser/descriptors/restarts", HUGE),
    "an angle of NaN": put("diagnoser/descriptors/restart_rotation_deg", NAN),
    "1e9 points of a description": put("diagnoser/points", HUGE),
    "a cause without a classifier": put("diagnoser/classifier/causes", lambda causes: causes[:2]),
    "three states": put("diagnoser/classifier/failure/classes", ["nominal", "failed", "odd"]),
    "a diagnoser of nothing": put("diagnoser", {}),
    "a diagnoser of text": put("diagnoser", "magic"),
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
    "an action of a number": put("treatments/noise", 5),
    "a list that holds itself": holds_itself,
    "a title of two lines": put("title", "Mugs\nTraceback"),
    "a title of a number": put("title", 7),
    "a doubtful stand-in": put("stand_in", "no"),
    "no settings": drop("encoder_settings"),
    "no thresholds": drop("thresholds"),
    "no title": drop("title"),
    "another version": put("version", 4),
    "another format": put("format", "a model"),
}  # fmt: skip


TO_EXPLAIN = [  # what would take the time, the memory or the terminal of who explains
    "one weight of infinity", "a tensor without its data", "draws of 1e9", "draws of the encoder of 1e9",
    "1e9 points drawn", "a width of 1e9", "neighbours of 1e9", "a negative distance", "1e9 iterations",
    "a title of two lines", "a list that holds itself",
]  # fmt: skip


def spoil(path, fault):
    content = torch.load(path, weights_only=True)
    CONTENTS[fault](content)
    torch.save(content, path)


@pytest.mark.parametrize("fault", CONTENTS)
def test_a_model_with_what_cannot_be_is_not_loaded(fault, folder):
    spoil(folder / "model.pt", fault)
    with pytest.raises(InputError, match=r"model\.pt: is .*; make one with"):
        Model.load(folder / "model.pt")


@pytest.mark.parametrize("fault", TO_EXPLAIN)
def test_a_model_that_would_hang_or_fill_the_memory_is_refused(fault, folder):
    spoil(folder / "model.pt", fault)
    refusal(EXPLAIN, folder, "model.pt", "make one with")


def members(path, change):
    """Write the zip anew, each member as `change` gives it: name, content and compression."""
    with zipfile.ZipFile(path) as archive:
        found = [(info.filename, archive.read(info)) for info in archive.infolist()]
    with zipfile.ZipFile(path, "w", compresslevel=1) as archive:
        for name, content in found:
            for new_name, new_content, compression in change(name, content):
                archive.writestr(new_name, new_content, compression)


def is_data(name):
    return name.endswith("/data/0")


FILES = {
    "nothing": lambda path: path.write_bytes(b""),
    "half of it": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "text": lambda path: path.write_text("version https://git-lfs.github.com/spec/v1\n"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "a device": lambda path: (path.unlink(), path.symlink_to("/dev/zero")),
    "code": lambda path: torch.save(print, path),
    "an old pickle": lambda path: torch.save({"format": "GP-CA model"}, path, _use_new_zipfile_serialization=False),
    "a compressed bomb": lambda path: members(
        path,
        lambda name, content: [(name, bytes(600 << 20) if is_data(name) else content, zipfile.ZIP_DEFLATED)],
    ),
    "a member that is gone": lambda path: members(
        path, lambda name, content: [] if is_data(name) else [(name, content, zipfile.ZIP_STORED)]
    ),
    "a member that is too short": lambda path: members(
        path, lambda name, content: [(name, content[:8] if is_data(name) else content, zipfile.ZIP_STORED)]
    ),
}


@pytest.mark.parametrize("fault", FILES)
def test_a_file_that_is_no_model_is_refused(fault, folder):
    FILES[fault](folder / "model.pt")
    refusal(EXPLAIN, folder, "model.pt", "make one with")


def flip(content, position):
    changed = bytearray(content)
    changed[position] ^= 1 << (position % 8)
    return bytes(changed)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_a_flipped_bit_in_the_data_is_found(share, folder):
    path = folder / "model.pt"
    with zipfile.ZipFile(path) as archive:
        tensors = [info for info in archive.infolist() if "/data/" in info.filename]
        info = max(tensors, key=lambda info: info.file_size)
        content = archive.read(info)
    start = path.read_bytes().index(content)
    path.write_bytes(flip(path.read_bytes(), start + int(share * len(content))))
    refusal(EXPLAIN, folder, "model.pt", "checksum")


def tensors_of(model):
    kernel = model.gpc.state()["kernel"]
    return [
        *model.encoder.state_dict().values(),
        *kernel.values(),
        *map(torch.as_tensor, vars(model.gpc._latents).values()),
    ]


def test_a_flipped_bit_anywhere_is_found_or_harmless(saved, tmp_path):
    """Data, headers, padding, directory: 400 places, drawn anew nowhere."""
    content, expected = saved.read_bytes(), Model.load(saved)
    path = tmp_path / "model.pt"
    found = 0
    for position in np.random.default_rng(0).integers(len(content), size=400):
        path.write_bytes(flip(content, int(position)))
        try:
            loaded = Model.load(path)
        except InputError:
            found += 1
            continue
        assert all(map(torch.equal, tensors_of(loaded), tensors_of(expected)))
        for name in ("encoder_settings", "icp", "cloud_points", "policy", "title", "stand_in", "concepts"):
            assert getattr(loaded, name) == getattr(expected, name)
    assert found > 200


SETTINGS = '{"draw_points": 64, "draws": 2, "options": {"k": 8, "point_features": 16}}'
EMBED = ["embed", "--source", "s", "--seed", 0, "--registrations", "registrations.npz", "--registration-timings",
         "seconds.csv", "--encoder", "weights.pt", "--out", "new.npz", "--timings", "new.csv",
         "--settings", SETTINGS]  # fmt: skip


@pytest.fixture(scope="module")
def trained(registrations, tmp_path_factory):
    from gpca.encoders.settings import EncoderSettings
    from gpca.encoders.training import make_model

    folder = tmp_path_factory.mktemp("trained")
    registrations.save(folder / "registrations.npz")
    rows = zip(registrations.sample, registrations.split, strict=True)
    lines = [f"{sample},{split},0.5,0.5" for sample, split in rows]
    (folder / "seconds.csv").write_text("\n".join(["sample,split,seconds,icp_seconds", *lines, ""]))
    settings = EncoderSettings(draw_points=64, draws=2, options={"k": 8, "point_features": 16})
    torch.save(make_model(settings).state_dict(), folder / "weights.pt")
    return folder


def of_weights(spoil):
    def change(path):
        state = torch.load(path, weights_only=True)
        spoil(state)
        torch.save(state, path)

    return change


def flip_middle(path):
    path.write_bytes(flip(path.read_bytes(), path.stat().st_size // 2))


WEIGHTS = {
    **{name: FILES[name] for name in FILES if name != "a member that is gone"},
    "NaN": of_weights(lambda state: state["head.weight"].fill_(NAN)),
    "huge": of_weights(lambda state: state["head.weight"].fill_(1e30)),
    "another head": of_weights(lambda state: state.update({"head.weight": torch.zeros(7, 32)})),
    "no head": of_weights(lambda state: state.pop("head.bias")),
    "more": of_weights(lambda state: state.update({"more": torch.zeros(1)})),
    "numbers": of_weights(lambda state: state.update({"head.bias": 7})),
    "a flipped bit": flip_middle,
}


@pytest.mark.parametrize("fault", WEIGHTS)
def test_weights_that_cannot_be_are_refused(fault, trained, tmp_path):
    for name in ("registrations.npz", "seconds.csv", "weights.pt"):
        (tmp_path / name).write_bytes((trained / name).read_bytes())
    WEIGHTS[fault](tmp_path / "weights.pt")
    refusal(EMBED, tmp_path, "weights.pt", "python -m gpca train")
