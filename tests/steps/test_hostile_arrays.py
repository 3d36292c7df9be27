"""What a later step reads of an earlier one, arrays and CSVs, damaged or with what cannot be."""

import io
import shutil
import zipfile

import numpy as np
import pytest

from gpca.arrays import save_arrays
from gpca.shift.sets import DISTANCES
from gpca.uncertainty.designs import DESIGNS

from ..hostile import refusal

K = len(DESIGNS["removal"].conditions)
COMMON = ["--source", "s"]
COMMANDS = {
    "objects.npz": ["registrations", *COMMON, "--seed", 0, "--objects", "objects.npz", "--out", "new.npz",
                    "--timings", "new.csv"],
    "registrations.npz": ["train", *COMMON, "--seed", 0, "--registrations", "registrations.npz", "--out", "new.pt",
                          "--curve", "new.csv"],
    "embeddings.npz": ["reduce", *COMMON, "--reduction", "none", "--seeds", 0, "--embeddings", "embeddings.npz",
                       "--out", "new.npz"],
    "uncertainty.npz": ["attribute", *COMMON, "--explainer", "shap_removal", "--seeds", 0, "--registrations",
                        "registrations.npz", "--uncertainty", "uncertainty.npz", "--uncertainty-timings",
                        "conditions.csv", "--input-timings", "seconds.csv", "--predictions", "new.csv", "--timings",
                        "new_seconds.csv"],
    "shifted.npz": ["learners", *COMMON, "--learners", "learner_nearest", "--seeds", 0, "--sets", "shifted.npz",
                    "--out", "new.csv"],
    "seconds.csv": ["attribute", *COMMON, "--explainer", "gpca", "--seeds", 0, "--registrations", "registrations.npz",
                    "--embeddings", "embeddings.npz", "--input-timings", "seconds.csv", "--predictions", "new.csv",
                    "--timings", "new_seconds.csv"],
}  # fmt: skip
COMMANDS["conditions.csv"] = COMMANDS["uncertainty.npz"]
NEEDED = {"objects.npz": "points_m", "registrations.npz": "points", "embeddings.npz": "h"}
NEEDED |= {"uncertainty.npz": "covariance", "shifted.npz": "distance"}


@pytest.fixture(scope="module")
def made(objects, registrations, tmp_path_factory):
    """One good file of each kind, by which the bad ones are made."""
    folder = tmp_path_factory.mktemp("made")
    random = np.random.default_rng(0)
    n = len(registrations)
    points = {
        key: np.concatenate([cloud[i] for cloud in objects.clouds]) for i, key in enumerate(("points_m", "normals"))
    }
    offsets = np.cumsum([0, *(len(cloud) for cloud, _ in objects.clouds)])
    names = {"names": np.array(objects.names), "diameters_m": objects.diameters_m}
    save_arrays(folder / "objects.npz", names | points | {"offsets": offsets})
    registrations.save(folder / "registrations.npz")
    of_samples = {"sample": registrations.sample, "split": registrations.split}
    embeddings = {"h": random.normal(size=(n, 8)), "head_logits": random.normal(size=(n, 3))}
    save_arrays(folder / "embeddings.npz", embeddings | of_samples)
    outcomes = {"covariance": np.tile(np.eye(6), (n, K, 1, 1)), "uncertainty": random.normal(size=(n, K))}
    outcomes |= {"residual": np.ones((n, K)), "degenerate": np.zeros((n, K), bool), "icp_calls": np.ones((n, K), int)}
    save_arrays(folder / "uncertainty.npz", outcomes | of_samples)
    sets = {"set": np.full(n, "in_distribution"), "concept": registrations.concept, "h": embeddings["h"]}
    sets |= {"object_name": registrations.object_name, "distance": np.ones((n, len(DISTANCES)))}
    save_arrays(folder / "shifted.npz", sets | of_samples)
    lines = [f"{s},{split},0.5,0.5" for s, split in zip(registrations.sample, registrations.split, strict=True)]
    (folder / "seconds.csv").write_text("\n".join(["sample,split,seconds,icp_seconds", *lines, ""]))
    lines = [f"{s},{split},{k},0.5,0.5" for s, split in zip(*of_samples.values(), strict=True) for k in range(K)]
    (folder / "conditions.csv").write_text("\n".join(["sample,split,condition,seconds,icp_seconds", *lines, ""]))
    return folder


@pytest.fixture
def folder(made, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path


def change_arrays(path, **changes):
    with np.load(path) as archive:
        arrays = dict(archive)
    for name, change in changes.items():
        arrays[name] = change(arrays[name])
    np.savez(path, **arrays)


def at(*index, value):
    def change(array):
        array = array.astype(np.result_type(array.dtype, np.asarray(value).dtype)) if value is not None else array
        array[index] = value
        return array

    return change


def same(array):
    return np.broadcast_to(array[:1], array.shape).copy()


VALUES = {
    # What cannot be of objects
    ("objects.npz", "negative diameter", "diameter"): {"diameters_m": lambda d: -d},
    ("objects.npz", "diameter of nothing", "diameter"): {"diameters_m": at(1, value=0.0)},
    ("objects.npz", "diameter in millimetres", "diameter"): {"diameters_m": lambda d: 1e3 * d},
    ("objects.npz", "huge diameter", "diameters_m"): {"diameters_m": lambda d: 1e300 * d},
    ("objects.npz", "diameter of another object", "span"): {"diameters_m": at(0, value=5.0)},
    ("objects.npz", "points in millimetres", "span"): {"points_m": lambda p: 1e3 * p},
    ("objects.npz", "huge points", "points_m"): {"points_m": lambda p: p.astype(float) * 1e200},
    ("objects.npz", "one huge point", "span"): {"points_m": at(7, 0, value=1e9)},
    ("objects.npz", "all points equal", "span 0 m"): {"points_m": same},
    ("objects.npz", "complex points", "complex"): {"points_m": lambda p: p + 1j},
    ("objects.npz", "points of text", "type <U"): {"points_m": lambda p: p.astype(str)},
    ("objects.npz", "points of dates", "type datetime"): {"points_m": lambda p: p.astype("datetime64[s]")},
    ("objects.npz", "points far from the origin", "centred"): {"points_m": lambda p: p + 5},
    ("objects.npz", "normals of no length", "normal"): {"normals": lambda n: 0 * n},
    ("objects.npz", "long normals", "normal"): {"normals": lambda n: 2 * n},
    ("objects.npz", "two of one name", "one name"): {"names": lambda n: n[[0, 0, 2]]},
    ("objects.npz", "names of numbers", "names"): {"names": lambda n: np.arange(len(n))},
    ("objects.npz", "offsets of halves", "offsets"): {"offsets": lambda o: o + 0.0},
    ("objects.npz", "offsets that fall", "fit together"): {"offsets": lambda o: o[[0, 2, 1, 3]]},
    ("objects.npz", "no objects", "fit together"): {
        "names": lambda n: n[:0], "diameters_m": lambda d: d[:0], "offsets": lambda o: o[:1],
        "points_m": lambda p: p[:0], "normals": lambda n: n[:0],
    },
    # of registrations
    ("registrations.npz", "clouds in millimetres", "'points'"): {"points": lambda p: p * 1e6},
    ("registrations.npz", "huge targets", "target_points"): {"target_points": lambda p: p.astype(float) * 1e200},
    ("registrations.npz", "complex clouds", "complex"): {"points": lambda p: p + 1j},
    ("registrations.npz", "negative diameters", "diameter_m"): {"diameter_m": lambda d: -d},
    ("registrations.npz", "a fitness above 1", "fitness"): {"fitness": lambda f: f + 1.5},
    ("registrations.npz", "a negative RMSE", "inlier_rmse"): {"inlier_rmse": lambda r: r - 9},
    ("registrations.npz", "a mirrored pose", "T_target_source_icp"): {"T_target_source_icp": at(0, 0, value=-1.0)},
    ("registrations.npz", "a scaled pose", "T_target_source_true"): {"T_target_source_true": lambda T: 2 * T},
    ("registrations.npz", "a pose far away", "T_target_source_init"): {"T_target_source_init": at(3, 0, 3, value=1e9)},
    ("registrations.npz", "a sample twice", "sample"): {"sample": lambda s: 0 * s},
    ("registrations.npz", "a negative sample", "sample"): {"sample": at(0, value=-1)},
    ("registrations.npz", "an object before the first", "object_index"): {"object_index": at(0, value=-1)},
    ("registrations.npz", "a negative severity", "severity_noise"): {"severity_noise": lambda s: s - 1},
    ("registrations.npz", "names of numbers", "concept"): {"concept": lambda c: np.arange(len(c))},
    ("registrations.npz", "offsets of halves", "offsets"): {"offsets": lambda o: o + 0.5},
    # of embeddings
    ("embeddings.npz", "complex numbers", "complex"): {"h": lambda h: h + 1j},
    ("embeddings.npz", "huge numbers", "above 1e+15"): {"h": lambda h: h * 1e200},
    ("embeddings.npz", "infinity", "infinity"): {"h": at(3, 3, value=np.inf)},
    ("embeddings.npz", "no samples", "no training"): {
        "h": lambda h: h[:0], "head_logits": lambda h: h[:0], "sample": lambda s: s[:0], "split": lambda s: s[:0],
    },
    ("embeddings.npz", "samples of halves", "sample"): {"sample": lambda s: s + 0.5},
    # of outcomes
    ("uncertainty.npz", "negative variances", "covariance"): {"covariance": lambda c: -c},
    ("uncertainty.npz", "complex uncertainty", "complex"): {"uncertainty": lambda u: u + 1j},
    ("uncertainty.npz", "negative calls", "icp_calls"): {"icp_calls": lambda c: c - 5},
    ("uncertainty.npz", "doubtful degeneracy", "degenerate"): {"degenerate": lambda d: d + 0.5},
    ("uncertainty.npz", "other samples", "conditions.csv: holds other samples"): {"sample": lambda s: s + 1000},
    ("uncertainty.npz", "other conditions", "conditions"): {
        name: lambda a: a[:, :2] for name in ("covariance", "uncertainty", "residual", "degenerate", "icp_calls")
    },
    # of shifted sets
    ("shifted.npz", "negative distances", "negative"): {"distance": lambda d: -d},
    ("shifted.npz", "unknown sets", "unknown set"): {"set": lambda s: np.full_like(s, "x")},
    ("shifted.npz", "no training samples", "training"): {"split": lambda s: np.full_like(s, "test")},
    ("shifted.npz", "complex embeddings", "complex"): {"h": lambda h: h + 1j},
}  # fmt: skip


@pytest.mark.parametrize("case", VALUES, ids=lambda case: f"{case[0]}: {case[1]}")
def test_values_that_cannot_be_are_refused(case, folder):
    name, _, word = case
    change_arrays(folder / name, **VALUES[case])
    line = refusal(COMMANDS[name], folder, word)
    assert ".npz" in line or ".csv" in line


@pytest.mark.parametrize("explainer", ["shap_removal", "sa_prcc_additive", "residuals_logistic"])
def test_outcomes_of_another_design_are_refused(explainer, folder):
    names = ("covariance", "uncertainty", "residual", "degenerate", "icp_calls")
    change_arrays(folder / "uncertainty.npz", **{name: lambda array: array[:, :2] for name in names})
    head, *lines = (folder / "conditions.csv").read_text().splitlines()
    kept = [line for line in lines if int(line.split(",")[2]) < 2]
    (folder / "conditions.csv").write_text("\n".join([head, *kept, ""]))
    command = [explainer if word == "shap_removal" else word for word in COMMANDS["uncertainty.npz"]]
    refusal(command, folder, "uncertainty.npz", "2 conditions are not those of design")


def header(shape, descr="'<f4'", version=b"\x01\x00"):
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    length = len(text).to_bytes(2 if version[0] == 1 else 4, "little")
    return b"\x93NUMPY" + version + length + text


def rewritten(path, name, content, compression=zipfile.ZIP_DEFLATED):
    """Put other bytes, or a function that writes them, in the place of one array."""
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    members.pop(f"{name}.npy")
    with zipfile.ZipFile(path, "w", compression, compresslevel=1) as archive:
        for filename, kept in members.items():
            archive.writestr(filename, kept)
        with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
            content(stream) if callable(content) else stream.write(content)


def zeros(head, size):
    def write(stream):
        stream.write(head)
        piece = bytes(1 << 20)
        for _ in range(size >> 20):
            stream.write(piece)

    return write


def bomb(path, name):
    with np.load(path) as archive:
        shape = archive[name].shape
    rows = (600 << 20) // int(4 * np.prod(shape[1:]))
    rewritten(path, name, zeros(header((rows, *shape[1:])), rows * int(4 * np.prod(shape[1:]))))


def unread_bomb(path, name):
    """An array that no one asks for, and an asked one that is not there."""
    rewritten(path, name, b"")
    archive = zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1)
    with archive, archive.open("other.npy", "w") as stream:
        zeros(header((1 << 28,)), 1 << 30)(stream)


def twice(path, name):
    with np.load(path) as archive:
        content = io.BytesIO()
        np.save(content, archive[name])
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr(f"{name}.npy", content.getvalue())


def flipped(path, name):
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        info = archive.getinfo(f"{name}.npy")
    content[info.header_offset + 128 + info.file_size // 2] ^= 1
    path.write_bytes(content)


FILES = {
    "a bomb": bomb,
    "a bomb that nobody asks for": unread_bomb,
    "a header of gigabytes": lambda path, name: rewritten(
        path, name, zeros(b"\x93NUMPY\x02\x00" + (2**31).to_bytes(4, "little"), 600 << 20)
    ),
    "more rows than data": lambda path, name: rewritten(path, name, header((10**15, 3))),
    "negative rows": lambda path, name: rewritten(path, name, header((-1, 3))),
    "rows of no number": lambda path, name: rewritten(path, name, header(("'many'", 3))),
    "a header that is no header": lambda path, name: rewritten(path, name, header("__import__('os').getpid()")),
    "pickled objects": lambda path, name: rewritten(path, name, header((1,), "'|O'") + b"cos\ngetpid\n(tR."),
    "records": lambda path, name: rewritten(path, name, header((1,), "[('x', '<f4')]") + bytes(4)),
    "an unknown version": lambda path, name: rewritten(path, name, header((1,), version=b"\x09\x00")),
    "more data than rows": lambda path, name: rewritten(path, name, header((1, 3)) + bytes(5000)),
    "bzip2": lambda path, name: rewritten(path, name, header((4, 3)) + bytes(48), zipfile.ZIP_BZIP2),
    "an array twice": twice,
    "a flipped bit": flipped,
    "half of it": lambda path, name: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "nothing": lambda path, name: path.write_bytes(b""),
    "a folder": lambda path, name: (path.unlink(), path.mkdir()),
    "a device": lambda path, name: (path.unlink(), path.symlink_to("/dev/zero")),
}


@pytest.mark.parametrize("fault", FILES)
@pytest.mark.parametrize("name", ["objects.npz", "registrations.npz"])
def test_files_that_are_no_arrays_are_refused(fault, name, folder):
    FILES[fault](folder / name, NEEDED[name])
    refusal(COMMANDS[name], folder, name, "make it")


@pytest.mark.parametrize("fault", ["a bomb", "pickled objects", "a flipped bit"])
@pytest.mark.parametrize("name", ["embeddings.npz", "uncertainty.npz", "shifted.npz"])
def test_other_files_that_are_no_arrays_are_refused(fault, name, folder):
    FILES[fault](folder / name, NEEDED[name])
    refusal(COMMANDS[name], folder, name, "make it")


def cell(text):
    return lambda lines: [*lines[:3], lines[3].replace("0.5", text, 1), *lines[4:]]


LINES = {
    "NaN": cell("nan"),
    "infinity": cell("inf"),
    "negative": cell("-0.5"),
    "text": cell("long"),
    "empty": cell(""),
    "complex": cell("0.5+1j"),
    "missing column": lambda lines: [line.rsplit(",", 1)[0] for line in lines],
    "missing row": lambda lines: lines[:-1],
    "row twice": lambda lines: [*lines, lines[-1]],
    "too wide": lambda lines: [lines[0], *(f"7,{line}" for line in lines[1:])],
    "nothing": lambda lines: [],
    "head alone": lambda lines: lines[:1],
    "binary": lambda lines: ["\udcff\udcfe\0"],
}


@pytest.mark.parametrize("fault", LINES)
@pytest.mark.parametrize("name", ["seconds.csv", "conditions.csv"])
def test_seconds_that_cannot_be_are_refused(fault, name, folder):
    lines = (folder / name).read_text().splitlines()
    text = "".join(f"{line}\n" for line in LINES[fault](lines))
    (folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))
    refusal(COMMANDS[name], folder, name, "make it anew")


@pytest.mark.parametrize("name", ["embeddings.npz", "objects.npz"])
def test_the_same_files_unspoilt_are_read(name, folder, monkeypatch):
    """Compressed as well, and with arrays of a user's own."""
    from gpca.__main__ import main

    with np.load(folder / name) as archive:
        np.savez_compressed(folder / name, **archive, own=np.arange(3))
    monkeypatch.chdir(folder)
    for variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(variable, "1")
    settings = ["--settings", '{"train": 9, "test": 3, "cloud_points": 64}'] if name == "objects.npz" else []
    assert main([*map(str, COMMANDS[name]), *settings]) == 0
    assert (folder / "new.npz").is_file()
