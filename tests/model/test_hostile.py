"""Model files that are damaged, or contain impossible values, and files of points and poses that cannot be used."""

import functools
import zipfile

import numpy as np
import pytest
import torch

from gpca.errors import InputError
from gpca.io.array_tree import read_tree
from gpca.model.file import Model

from ..hostile import refusal
from .conftest import BALL, in_version_4, write_anything

EXPLAIN = ["explain", "ball.ply", "ball.ply", "--unit", "mm", "--model", "model.pt"]
NAN, HUGE = float("nan"), 10**9


def part(content, path):
    """The mapping that a path of names ends in, and its last name."""
    *parents, last = path.split("/")
    return functools.reduce(lambda inner, name: inner[name], parents, content), last


def put(path, value):
    def spoil(content):
        inner, last = part(content, path)
        inner[last] = value(inner[last]) if callable(value) else value

    return spoil


def drop(path):
    return lambda content: part(content, path)[0].pop(path.rpartition("/")[2])


def spoil(path, change):
    content = read_tree(path)
    change(content)
    write_anything(path, content)


def indefinite(covariance):
    """Variances above 0, and between the first two values a correlation of 2."""
    covariance = covariance.copy()
    covariance[:, 0, 1] = covariance[:, 1, 0] = 2 * np.sqrt(covariance[:, 0, 0] * covariance[:, 1, 1])
    return covariance


def weight(content):
    return next(array for array in content["encoder"].values() if array.ndim > 1)


def nested(content):
    for _ in range(200):
        content["treatments"]["noise"] = [content["treatments"]["noise"]]


def variances(content):
    name = next(name for name in content["encoder"] if name.endswith("running_var"))
    content["encoder"][name] = -content["encoder"][name]


def every_weight(change):
    return lambda content: content.update(encoder={name: change(w) for name, w in content["encoder"].items()})


def trees_of(roots=(0,), feature=(0, -1, -1), number=(0, 1, 2), right=(2, 1, 2)):
    """One question's only tree: a node and two leaves."""
    parts = {
        "roots": np.array(roots, np.int32), "right": np.array(right, np.int32),
        "feature": np.array(feature, np.int16), "number": np.array(number, np.float64),
    }  # fmt: skip
    return {"baseline": 0.0, **parts}


def level(path, value):
    """Of the first tolerance."""
    return lambda content: put(path, value)(content["diagnoser"]["levels"][0])


CONTENTS = {
    "weights of NaN": lambda content: weight(content).fill(NAN),
    "one weight of infinity": lambda content: weight(content).ravel()[3:4].fill(np.inf),
    "huge weights": lambda content: weight(content).fill(1e30),
    "negative running variances": variances,
    "weights of other shapes": every_weight(lambda array: array[..., :1] if array.ndim else array),
    "weights of doubles": every_weight(np.float64),
    "no weights": put("encoder", {}),
    "an array that is not in the file": put("gpc/mean", {"array": "nowhere"}),
    "an array of text": put("gpc/mean", np.array(["noise"])),
    "an array of objects": put("gpc/mean", np.array([{}])),
    "posterior of NaN": put("gpc/mean", lambda m: m * NAN),
    "posterior of other inducing inputs": put("gpc/mean", lambda m: m[:, :-1]),
    "negative variances": put("gpc/covariance", lambda c: -c),
    "a covariance that is not positive definite": put("gpc/covariance", indefinite),
    "a covariance that is not symmetric": put("gpc/covariance", np.triu),
    "a seed named by text": put("gpc/axes", "real"),
    "inducing inputs of another encoder": put("gpc/inducing", lambda z: z[:, :-1]),
    "labels of no concept": put("gpc/targets", lambda t: t + 7),
    "scales of nothing": put("gpc/scaler_scale", lambda s: 0 * s),
    "a kernel of NaN": lambda content: content["gpc"]["kernel"]["scale"].fill(NAN),
    "a kernel of negative scales": put("gpc/kernel/scale", lambda scale_C: -scale_C),
    "a kernel of other parts": put("gpc/kernel/offset", np.ones(3)),
    "another kernel": put("gpc/settings/kernel", "cubic"),
    "a concept twice": put("gpc/classes", ["noise", "noise", "pose"]),
    "concepts in another order": put("gpc/classes", ["overlap", "noise", "pose"]),
    "a concept of two lines": put("gpc/classes", ["noise", "pose\nTraceback", "overlap"]),
    "draws of 1e9": put("gpc/settings/draws", HUGE),
    "draws of the encoder of 1e9": put("encoder_settings/draws", HUGE),
    "1e9 points drawn": put("encoder_settings/points", HUGE),
    "an unknown backbone": put("encoder_settings/backbone", "os.system"),
    "a width of 1e9": put("encoder_settings/options/point_features", HUGE),
    "neighbours of 1e9": put("encoder_settings/options/k", HUGE),
    "a negative distance": put("icp/correspondence_distance", -0.1),
    "1e9 iterations": put("icp/max_iterations", HUGE),
    "an unknown method": put("icp/method", "magic"),
    "clouds of 1e12 points": put("points", 10**12),
    "a threshold of NaN": put("thresholds/uncertain", NAN),
    "a share above 1": put("thresholds/dominant", 7.0),
    "an action that no robot has": put("treatments/noise", "rm -rf"),
    "an action that is no treatment": put("treatments/noise", "nothing"),
    "a concept without a treatment": drop("treatments/pose"),
    "one action for two concepts": put("treatments/noise", "new_view"),
    "a list in a list, 200 times": nested,
    "a title of two lines": put("title", "Mugs\nTraceback"),
    "a doubtful stand-in": put("stand_in", "no"),
    "no ranges": drop("familiar"),
    "ranges of nothing": put("familiar", {}),
    "a range of text": put("familiar/size", ["small", "large"]),
    "a range that falls": put("familiar/depth", [1.0, 0.5]),
    "no settings": drop("encoder_settings"),
    "another version": put("version", 8),
    "another format": put("format", "a model"),
    "a threshold of a start of NaN": put("diagnoser/start_threshold", NAN),
    "a negative tolerance": level("tolerance", -0.03),
    "no tolerance at all": put("diagnoser/levels", []),
    "results by other numbers": put("diagnoser/judge/weights", lambda w: w[:-1]),
    "results by NaN": put("diagnoser/judge/weights", lambda w: NAN * w),
    "quantiles of other descriptors": put("diagnoser/classifier/quantiles", lambda q: q[:, :-1]),
    "quantiles that fall": put("diagnoser/classifier/quantiles", lambda q: q[::-1]),
    "1e9 starts": put("diagnoser/runs/starts", HUGE),
    "no way to move": put("diagnoser/moved", "both"),
    "features that nobody measures": put("diagnoser/reads", "tea leaves"),
    "features of an older diagnoser": put("diagnoser/reads", "remedied"),
    "trees for three questions": put("diagnoser/classifier/trees", lambda trees: trees[:3]),
    "trees without end": put("diagnoser/classifier/trees", lambda trees: [trees_of(right=[1, 1, 1])] * 4),
    "trees that lead elsewhere": put("diagnoser/classifier/trees", lambda trees: [trees_of(right=[9, 1, 2])] * 4),
    "trees that start elsewhere": put("diagnoser/classifier/trees", lambda trees: [trees_of(roots=[3])] * 4),
    "trees of other features": put("diagnoser/classifier/trees", lambda trees: [trees_of(feature=[999, -1, -1])] * 4),
    "trees of NaN": put("diagnoser/classifier/trees", lambda trees: [trees_of(number=[NAN, 0, 0])] * 4),
    "trees of text": put("diagnoser/classifier/trees", [{"roots": "0"}] * 4),
    "a guarantee of other states": level("guarantee/sets/states", list("abcde")),
    "a guarantee of nothing": level("guarantee", {"sets": 1}),
    "measures of text": put("diagnoser/held_out/samples", "many"),
    "a cause of other classes": lambda content: content["diagnoser"]["classifier"]["causes"][1].update(
        classes=["present", "absent"]
    ),
    "an indefinite covariance of a diagnoser": put("diagnoser/classifier/failure/covariance", indefinite),
    "a diagnoser of nothing": put("diagnoser", {}),
}  # fmt: skip


@pytest.mark.parametrize("fault", CONTENTS)
def test_a_model_with_what_cannot_be_is_not_loaded(fault, folder):
    spoil(folder / "model.pt", CONTENTS[fault])
    with pytest.raises(InputError, match=r"model\.pt: is .*; make one with"):
        Model.load(folder / "model.pt")


def members(path, change):
    """Write the zip anew, each member as `change` gives it: name, content and compression."""
    with zipfile.ZipFile(path) as archive:
        found = [(info.filename, archive.read(info)) for info in archive.infolist()]
    with zipfile.ZipFile(path, "w", compresslevel=1) as archive:
        for name, content in found:
            for new_name, new_content, compression in change(name, content):
                archive.writestr(new_name, new_content, compression)


def is_data(name):
    return name.endswith("0.norm.bias.npy") or name.endswith("/data/0")


FILES = {
    "nothing": lambda path: path.write_bytes(b""),
    "half of it": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "text": lambda path: path.write_text("version https://git-lfs.github.com/spec/v1\n"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "a device": lambda path: (path.unlink(), path.symlink_to("/dev/zero")),
    "code": lambda path: torch.save(print, path),
    "an old pickle": lambda path: torch.save({"format": "GP-CA model"}, path, _use_new_zipfile_serialization=False),
    "a compressed bomb": lambda path: members(
        path, lambda name, content: [(name, bytes(600 << 20) if is_data(name) else content, zipfile.ZIP_DEFLATED)]
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
    return content[:position] + bytes([content[position] ^ 1 << (position % 8)]) + content[position + 1 :]


def of_torch(change):
    """The file as torch wrote models, changed."""

    def spoil(path):
        content = in_version_4(read_tree(path))
        change(content)
        torch.save(content, path)

    return spoil


def holds_itself(content):
    content["treatments"]["noise"] = [content]
    content["treatments"]["noise"].append(content["treatments"]["noise"])


OLDER = {
    "a tensor without its data": put("gpc/mean", lambda m: torch.zeros(1, dtype=m.dtype).expand(3, 10**12)),
    "a meta tensor": put("gpc/mean", torch.zeros(10**6, 10**6, device="meta")),
    "a sparse tensor": put("gpc/mean", lambda m: m.to_sparse()),
    "a tensor of complex numbers": put("gpc/mean", lambda m: m + 0j),
    "a kernel of NaN": lambda content: content["gpc"]["kernel"]["raw_outputscale"].fill_(NAN),
    "a kernel without a scale": drop("gpc/kernel/raw_outputscale"),
    "no diagnoser": drop("diagnoser"),
    "a list that contains itself": holds_itself,
    "code": put("title", print),
}


@pytest.mark.parametrize("fault", OLDER)
def test_an_older_file_with_what_cannot_be_is_not_loaded(fault, folder):
    of_torch(OLDER[fault])(folder / "model.pt")
    with pytest.raises(InputError, match=r"model\.pt: is .*; make one with"):
        Model.load(folder / "model.pt")


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_a_flipped_bit_in_the_data_is_found(share, folder):
    path = folder / "model.pt"
    with zipfile.ZipFile(path) as archive:
        tensors = [info for info in archive.infolist() if info.filename.endswith(".npy")]
        info = max(tensors, key=lambda info: info.file_size)
        content = archive.read(info)
    start = path.read_bytes().index(content)
    path.write_bytes(flip(path.read_bytes(), start + int(share * len(content))))
    refusal(EXPLAIN, folder, "model.pt", "checksum")


def arrays_of(model):
    covariance = model.gpc._prior.covariance
    return [
        *model.encoder.weights.values(),
        covariance.scale_C,
        covariance.parameter_C,
        *vars(model.gpc._latents).values(),
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
        assert all(map(np.array_equal, arrays_of(loaded), arrays_of(expected)))
        assert loaded.encoder.settings == expected.encoder.settings
        for name in ("icp", "cloud_points", "policy", "title", "stand_in"):
            assert getattr(loaded, name) == getattr(expected, name)
    assert found > 200


POINTS = np.random.default_rng(0).normal(size=(200, 3)) * 30


def ascii_cloud(rows, properties="xyz"):
    head = "\n".join(
        ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *(f"property float {p}" for p in properties)]
    )
    return lambda path: path.write_text("\n".join([head, "end_header", *(" ".join(map(str, row)) for row in rows), ""]))


CLOUDS = {
    "nothing.ply": lambda path: path.touch(),
    "wide.ply": ascii_cloud([(1051, *row) for row in POINTS]),
    "same.ply": ascii_cloud([(1, 2, 3)] * 200),
    "giant.ply": lambda path: path.open("wb").truncate(5 * 10**9),
    "device.ply": lambda path: path.symlink_to("/dev/zero"),
    "folder.ply": lambda path: path.mkdir(),
    "cut.vtk": lambda path: path.write_text("# vtk DataFile\n\nASCII\nDATASET POLYDATA\nPOINTS 99 float\n1\n"),
    "nan.xyz": lambda path: np.savetxt(path, np.where(POINTS > -60, np.nan, POINTS)),
    "scan.las": lambda path: path.write_bytes(b"LASF"),
    "scene.glb": lambda path: path.write_bytes(BALL.export(file_type="glb")[:500]),
}


@pytest.mark.parametrize(("name", "role"), [(name, i % 2) for i, name in enumerate(CLOUDS)])
def test_points_that_cannot_be_explained_are_refused(name, role, folder):
    CLOUDS[name](folder / name)
    files = ["ball.ply", "ball.ply"]
    files[role] = name
    refusal(["explain", *files, *EXPLAIN[3:]], folder, name)


POSES = {"empty": "", "words": "one " * 16, "mirrored": "-1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1", "giant": "0 " * 10**6}


@pytest.mark.parametrize("fault", POSES)
def test_a_start_that_is_no_pose_is_refused(fault, folder):
    (folder / "pose.txt").write_bytes(POSES[fault].encode("utf-8", "surrogateescape"))
    refusal([*EXPLAIN, "--init", "pose.txt"], folder, "pose.txt")
