"""``python -m gpca``: every step by hand on tiny data, and what it says when a file or a setting is wrong."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import gpca
from gpca import __main__ as command_line
from gpca.__main__ import STEPS, main
from gpca.code_files import ROOT
from gpca.files import save_arrays
from gpca.model.file import Model
from gpca.recovery.policy import RecoveryPolicy, Thresholds

ENCODER = {"draw_points": 64, "draws": 2, "epochs": 2, "batch_size": 12, "options": {"k": 8, "point_features": 16}}
POLICY = {
    "thresholds": {"uncertain": None, "queued_share": 0.1, "dominant": 0.4, "improvement": 0.1},
    "treatments": {"noise": "denoise", "pose": "reinitialise", "overlap": "new_view"},
    "loop": {"budget": 3},
}
LEARNING = {
    "held_out": ["noise", "overlap"], "initial": 6, "labels": 4, "batch": 2, "rare_share": 0.2, "rare_labels": 2,
    "gpc": {"iterations": 5, "inducing": 6, "draws": 20},
    "stream": {"arrivals": 8, "quiet": 2, "budget": 0.5, "every": 2},
}  # fmt: skip
SHIFT = {
    "samples": 6, "severities": {"noise": [0.03, 0.05], "crop": [0.6, 0.7]}, "held_out_share": 0.5, "train": 9,
    "encoder": {"epochs": 1, "draws": 1}, "neighbours": 3, "shape_points": 16,
}  # fmt: skip
COMMON = {"--source": "tiny"}
STEP_OPTIONS = {
    "objects": COMMON | {
        "--settings": {"kind": "mesh_folder", "location": "meshes", "unit": "mm"}, "--data-dir": ".",
        "--surface-points": 600, "--out": "objects.npz",
    },
    "registrations": COMMON | {
        "--settings": {"train": 18, "test": 6, "cloud_points": 128}, "--seed": 0, "--objects": "objects.npz",
        "--out": "registrations.npz", "--timings": "icp.csv",
    },
    "train": COMMON | {
        "--settings": ENCODER, "--seed": 0, "--registrations": "registrations.npz", "--out": "weights.pt",
        "--curve": "curve.csv",
    },
    "embed": COMMON | {
        "--settings": ENCODER, "--seed": 0, "--registrations": "registrations.npz",
        "--registration-timings": "icp.csv", "--encoder": "weights.pt", "--out": "embeddings.npz",
        "--timings": "dgcnn.csv",
    },
    "reduce": COMMON | {
        "--settings": {"components": 4, "epochs": 5}, "--reduction": "autoencoder", "--seeds": 0,
        "--embeddings": "embeddings.npz", "--out": "reduced.npz",
    },
    "uncertainty": COMMON | {
        "--settings": {"starts": 13, "icp_points": 40, "icp": {"max_iterations": 20}},
        "--design": "removal", "--seeds": 0, "--registrations": "registrations.npz",
        "--out": "uncertainty.npz", "--tables": "uncertainty.csv", "--timings": "uncertainty_timings.csv",
    },
    "attribute": COMMON | {
        "--settings": {"iterations": 5, "inducing": 6, "draws": 20}, "--explainer": "gpca", "--seeds": 0,
        "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--input-timings": "dgcnn.csv",
        "--predictions": "predictions.csv", "--timings": "gpca.csv",
    },
    "without": COMMON | {
        "--settings": ENCODER | {"epochs": 1}, "--seed": 0, "--registrations": "registrations.npz",
        "--concepts": ["noise", "overlap"], "--out": "without.npz",
    },
    "active_learning": COMMON | {
        "--settings": LEARNING, "--seed": 0, "--registrations": "registrations.npz", "--embeddings": "embeddings.npz",
        "--embeddings-without": "without.npz", "--strategies": ["random", "bald_kmeans", "stream_bald"],
        "--out": ["random.csv", "bald_kmeans.csv", "stream_bald.csv"],
    },
    "kernel_grid": COMMON | {
        "--settings": {"kernels": ["rbf", "polynomial"], "iterations": [2, 4], "inducing": 6, "draws": 20},
        "--seeds": 0, "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--out": "grid.csv",
    },
    "shift": COMMON | {
        "--settings": {"shift": SHIFT, "registrations": {"cloud_points": 128}, "encoder": ENCODER}, "--seeds": 0,
        "--objects": "objects.npz", "--registrations": "registrations.npz",
        "--other-registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--encoders": "weights.pt",
        "--out": "shifted.npz",
    },
    "learners": COMMON | {
        "--settings": {"gpca": {"iterations": 5, "inducing": 6, "draws": 20}, "learner_nearest": {}}, "--seeds": 0,
        "--learners": ["gpca", "learner_nearest"], "--sets": "shifted.npz", "--out": ["learnt.csv", "nearest.csv"],
    },
    "label": {
        "registrations.npz": [], "--settings": {"iterations": 5, "inducing": 6, "draws": 20}, "--initial": 6,
        "--embeddings": "embeddings.npz", "--labels": "labels.csv", "--answers": "answers.txt",
        "--predictions": "labelled.csv",
    },
    "model": COMMON | {
        "--settings": {"encoder": ENCODER, "gpc": {"iterations": 5, "inducing": 6, "draws": 20},
                       "registrations": {"cloud_points": 128}, "recovery": POLICY},
        "--title": "Tiny", "--stand-in": [], "--seed": 0, "--registrations": "registrations.npz",
        "--encoder": "weights.pt", "--embeddings": "embeddings.npz", "--out": "model.pt",
    },
    "runtime": COMMON | {
        "--settings": {"runtime": {"repeats": 2}, "active_learning": LEARNING}, "--seed": 0, "--model": "model.pt",
        "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--out": "runtime.csv",
    },
    "explain": {"meshes/brick.stl": [], "meshes/cone.ply": [], "--unit": "mm", "--model": "model.pt", "--json": []},
}  # fmt: skip
# tests/frames/test_steps.py, tests/steps/test_recover.py, tests/comparison/test_reference.py
ELSEWHERE = {"scenes", "instances", "frame_registrations", "recover", "check-reference"}
BY_HAND = {"labels.csv", "answers.txt"}  # given by a person, not made


def test_every_step_is_tested_here_or_elsewhere():
    assert set(STEPS) == set(STEP_OPTIONS) | ELSEWHERE


def arguments(step, changes=()):
    """The command line of a step, with some options changed and those that are None left out."""
    words = [step]
    for name, value in (STEP_OPTIONS[step] | dict(changes)).items():
        if value is not None:
            values = value if isinstance(value, list) else [json.dumps(value) if isinstance(value, dict) else value]
            words += [name, *map(str, values)]
    return words


@pytest.fixture(autouse=True)
def threads_restored(monkeypatch):
    """The command line sets these for its own process, which here is that of all tests."""
    for variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(variable, os.environ.get(variable, "1"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder where every step has run by hand, one after the other."""
    import trimesh

    folder = tmp_path_factory.mktemp("made")
    (folder / "meshes").mkdir()
    trimesh.creation.box((40, 70, 100)).export(folder / "meshes/brick.stl")
    trimesh.creation.cone(30, 90).export(folder / "meshes/cone.ply")
    (folder / "answers.txt").write_text("overlap\nocclusion\n/skip\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for step in STEP_OPTIONS:
            assert main(arguments(step)) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """A copy of that folder to spoil, and the working folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_every_step_runs_by_hand(made):
    values = [value for options in STEP_OPTIONS.values() for value in options.values()]
    words = [word for value in values for word in (value if isinstance(value, list) else [value])]
    outputs = {word for word in words if isinstance(word, str) and "." in word[1:]} - BY_HAND
    for name in outputs:
        assert (made / name).stat().st_size > 0
        assert (made / f"{name}.provenance.json").is_file()
    assert not [path for path in made.rglob("*") if "checkpoint" in path.name or "partial" in path.name]


def test_a_step_made_anew_gives_the_same_bytes(folder, made):
    for step in (
        "registrations",
        "train",
        "embed",
        "reduce",
        "uncertainty",
        "attribute",
        "without",
        "active_learning",
        "kernel_grid",
        "shift",
        "learners",
    ):
        assert main(arguments(step)) == 0
    for name in (
        "registrations.npz",
        "weights.pt",
        "curve.csv",
        "embeddings.npz",
        "reduced.npz",
        "uncertainty.npz",
        "uncertainty.csv",
        "predictions.csv",
        "without.npz",
        "random.csv",
        "bald_kmeans.csv",
        "stream_bald.csv",
        "grid.csv",
        "shifted.npz",
        "learnt.csv",
    ):
        assert (folder / name).read_bytes() == (made / name).read_bytes(), name


def test_reduced_embeddings_are_of_the_same_samples_and_each_seed_has_its_own(folder):
    given = {"--seeds": [0, 1], "--embeddings": ["embeddings.npz"] * 2, "--out": ["reduced.npz", "other.npz"]}
    assert main(arguments("reduce", given)) == 0
    whole, reduced, other = (np.load(folder / name) for name in ("embeddings.npz", "reduced.npz", "other.npz"))
    assert reduced["h"].shape == (24, 4)
    assert reduced["h"].dtype == np.float32
    for name in ("head_logits", "sample", "split"):
        assert np.array_equal(reduced[name], whole[name])
    assert not np.array_equal(other["h"], reduced["h"])


def test_unreduced_embeddings_are_those_that_were_given(folder):
    assert main(arguments("reduce", {"--reduction": "none", "--settings": {}})) == 0
    assert np.array_equal(np.load(folder / "reduced.npz")["h"], np.load(folder / "embeddings.npz")["h"])


def settings(step, **changed):
    return {"--settings": STEP_OPTIONS[step]["--settings"] | changed}


def arrays_changed(name, **changed):
    def spoil(folder):
        with np.load(folder / name) as archive:
            arrays = dict(archive)
        save_arrays(folder / name, arrays | {key: change(arrays[key]) for key, change in changed.items()})

    return spoil


def pickled(name):
    def spoil(folder):
        with np.load(folder / name) as archive:
            arrays = {key: archive[key].astype(object) for key in archive.files}
        np.savez(folder / name, **arrays)

    return spoil


def truncated(name):
    return lambda folder: os.truncate(folder / name, (folder / name).stat().st_size // 2)


def removed(name):
    return lambda folder: (folder / name).unlink()


def written(name, text):
    return lambda folder: (folder / name).write_text(text)


def untouched(folder):
    pass


def lines_kept(name, lines):
    return lambda folder: (folder / name).write_text("".join((folder / name).open().readlines()[:lines]))


SHAP = {
    "--explainer": "shap_removal", "--settings": {}, "--embeddings": None, "--uncertainty": "uncertainty.npz",
    "--uncertainty-timings": "uncertainty_timings.csv", "--input-timings": "icp.csv",
}  # fmt: skip

FAULTS = {
    "objects": [
        (untouched, settings("objects", location="nowhere"), r"'mesh_folder': nowhere is not there; correct"),
        (untouched, {"--data-dir": "nowhere"}, r"nowhere: no such folder"),
        (lambda folder: (folder / "empty").mkdir(), settings("objects", location="empty"), r"the folder holds none of"),
        (truncated("meshes/cone.ply"), {}, r"cone.ply: is truncated or not a readable .ply file"),
        (untouched, settings("objects", unit="m"), r"object 'brick': its diameter is 128.5 m, so the declared unit"),
        (untouched, settings("objects", unit="inch"), r"setting unit: 'inch' is not one of"),
        (untouched, settings("objects", unti="mm"), r"setting unti: unknown; did you mean unit\?"),
        (untouched, {"--settings": {}}, r"kind 'None': there is no such kind"),
        (untouched, {"--settings": "{kind: x"}, r"--settings: not JSON"),
        (untouched, {"--settings": "[1]"}, r"--settings: not a JSON object"),
        (untouched, {"--out": "meshes/brick.stl/objects.npz"}, r"meshes/brick.stl"),
    ],
    "registrations": [
        (untouched, {"--objects": "nowhere.npz"}, r"nowhere.npz: no such file; make it with"),
        (pickled("objects.npz"), {}, r"objects.npz: holds pickled objects, which are never loaded"),
        (truncated("objects.npz"), {}, r"objects.npz: is not a readable npz archive"),
        (arrays_changed("objects.npz", normals=lambda n: n[1:]), {}, r"array 'normals' is 1199×3, not 1200×3"),
        (arrays_changed("objects.npz", points_m=lambda points: points * np.nan), {}, r"array 'points_m' holds NaN"),
        (untouched, settings("registrations", trian=9), r"setting trian: unknown; did you mean train\?"),
        (untouched, settings("registrations", severities={"crop": [0.6, 0.2]}), r"severity crop: .* runs downwards"),
        (untouched, settings("registrations", icp={"max_iterations": 0}), r"setting icp.max_iterations: 0 is less"),
    ],
    "train": [
        (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with 'python -m gpca registr"),
        (truncated("registrations.npz"), {}, r"registrations.npz: is not a readable npz archive"),
        (arrays_changed("registrations.npz", concept=lambda c: np.full_like(c, "x")), {}, r"unknown concept 'x'"),
        (untouched, settings("train", epochs="two"), r"setting epochs: 'two' is not of type 'integer'"),
        (untouched, settings("train", layers=3), r"setting layers: unknown; known are backbone, draw_points"),
        (untouched, settings("train", backbone="dgcn"), r"backbone 'dgcn': unknown; known are dgcnn"),
        (untouched, settings("train", backbone="dgcnn", options={"kk": 8}), r"options.kk: unknown; did you mean k\?"),
    ],
    "embed": [
        (removed("weights.pt"), {}, r"weights.pt: no such weights; make them anew with 'python -m gpca train'"),
        (truncated("weights.pt"), {}, r"weights.pt: not the weights of backbone 'dgcnn'"),
        (written("weights.pt", "no weights"), {}, r"weights.pt: not the weights of backbone 'dgcnn'"),
        (untouched, settings("embed", options={"k": 8}), r"weights.pt: not the weights of backbone 'dgcnn'"),
        (removed("icp.csv"), {}, r"icp.csv: no such file"),
        (written("icp.csv", ""), {}, r"icp.csv: is empty"),
        (written("icp.csv", 'sample,"split\n1'), {}, r"icp.csv: is not a readable CSV file"),
        (written("icp.csv", "sample,split,seconds,icp_seconds\n0,train,1,1\n"), {}, r"icp.csv: does not hold the sec"),
    ],
    "reduce": [
        (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
        (arrays_changed("embeddings.npz", h=lambda h: h * np.nan), {}, r"array 'h' holds NaN"),
        (arrays_changed("embeddings.npz", h=np.ones_like), {}, r"training embeddings: are all alike"),
        (arrays_changed("embeddings.npz", split=lambda s: np.full_like(s, "test")), {}, r"holds no training samples"),
        (untouched, settings("reduce", components=19), r"19 components of 18 training embeddings of 32 numbers; set"),
        (untouched, settings("reduce", components=0), r"setting components: 0 is less than the minimum of 1"),
        (untouched, settings("reduce", neighbours=3), r"'autoencoder': no setting 'neighbours'; known are components"),
        (untouched, {"--reduction": "tsne"}, r"reduction 'tsne': unknown; known are none, pca"),
        (untouched, {"--seeds": [0, 1]}, r"--embeddings: 1 file\(s\) for 2 seed\(s\); give one for each"),
    ],
    "uncertainty": [
        (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with 'python -m gpca registr"),
        (untouched, settings("uncertainty", starts=12), r"setting starts: 12 is less than the minimum of 13"),
        (untouched, settings("uncertainty", start=13), r"setting start: unknown; did you mean starts\?"),
        (untouched, settings("uncertainty", floor=0), r"setting floor: 0 is less than or equal to the minimum"),
        (untouched, settings("uncertainty", samples=4), r"setting samples: 4 is not a multiple of 3"),
        (untouched, settings("uncertainty", icp={"method": "gicp"}), r"setting method: 'gicp' is not one of"),
        (untouched, {"--seeds": [0, 1]}, r"--registrations: 1 file\(s\) for 2 seed\(s\); give one for each"),
    ],
    "attribute": [
        (untouched, SHAP | {"--uncertainty": None}, r"'shap_removal': reads the uncertainty of design 'removal'"),
        (removed("uncertainty.npz"), SHAP, r"uncertainty.npz: no such file; make it with 'python -m gpca"),
        (arrays_changed("uncertainty.npz", sample=lambda s: s + 50), SHAP, r"holds other samples or conditions"),
        (arrays_changed("uncertainty.npz", residual=lambda r: r * np.nan), SHAP, r"array 'residual' holds NaN"),
        (removed("uncertainty_timings.csv"), SHAP, r"uncertainty_timings.csv: no such file"),
        (lines_kept("uncertainty_timings.csv", 20), SHAP, r"holds 19 rows, not 24 samples × 8 conditions"),
        (untouched, SHAP | {"--settings": {"worth": "rmse"}}, r"rmse"),
        (untouched, {"--explainer": "shapley"}, r"explainer 'shapley': unknown; known are gpca_paper, gpca"),
        (untouched, {"--seeds": [0, 1]}, r"--registrations: 1 file\(s\) for 2 seed\(s\); give one for each"),
        (untouched, {"--embeddings": ["embeddings.npz"] * 2}, r"--embeddings: 2 file\(s\) for 1 seed\(s\)"),
        (untouched, {"--embeddings": None}, r"explainer 'gpca': reads embeddings; give them with --embeddings"),
        (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
        (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"holds other samples than the registr"),
        (arrays_changed("embeddings.npz", h=lambda h: h[:, 0]), {}, r"array 'h' is 24, not S×d"),
        (arrays_changed("embeddings.npz", h=lambda h: h[1:]), {}, r"array 'head_logits' is 24×3, not 23"),
        (written("dgcnn.csv", "sample,seconds\n"), {}, r"dgcnn.csv: column 'split' is missing"),
        (untouched, settings("attribute", iteratons=5), r"setting iteratons: unknown; did you mean iterations\?"),
        (untouched, settings("attribute", kernel="cubic"), r"setting kernel: 'cubic' is not one of"),
        (untouched, {"--predictions": "meshes"}, r"meshes"),
    ],
    "without": [
        (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with 'python -m gpca registr"),
        (untouched, settings("without", epochs=0), r"setting epochs: 0 is less than the minimum of 1"),
    ],
    "active_learning": [
        (removed("without.npz"), {}, r"without.npz: no such file; make it with 'python -m gpca without'"),
        (arrays_changed("without.npz", sample=lambda s: s + 1), {}, r"without.npz: holds other samples than the reg"),
        (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"embeddings.npz: holds other samples than"),
        (untouched, settings("active_learning", held_out=["noise", "pose"]), r"array 'h_pose' is missing"),
        (untouched, settings("active_learning", initial=18), r"leaves no pool of 18 training samples; lower active_l"),
        (untouched, settings("active_learning", label=4), r"setting label: unknown; did you mean labels\?"),
        (untouched, settings("active_learning", stream={"arrivals": 60, "quiet": 2}), r"stream of 60 arrivals: needs"),
        (untouched, {"--strategies": ["random", "bald", "oracle"]}, r"strategy 'oracle': unknown; known are random"),
        (untouched, {"--strategies": ["random"]}, r"--out: 3 file\(s\) for 1 strategies"),
    ],
    "kernel_grid": [
        (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
        (arrays_changed("embeddings.npz", h=lambda h: h * np.nan), {}, r"embeddings.npz: array 'h' holds NaN"),
        (untouched, settings("kernel_grid", kernels=["cubic"]), r"setting kernels.0: 'cubic' is not one of"),
        (untouched, settings("kernel_grid", iterations=[0]), r"setting iterations.0: 0 is less than the minimum"),
        (untouched, {"--seeds": [0, 1]}, r"--registrations: 1 file\(s\) for 2 seed\(s\)"),
    ],
    "shift": [
        (removed("weights.pt"), {}, r"weights.pt: no such weights"),
        (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"embeddings.npz: holds other samples than"),
        (untouched, settings("shift", shift=SHIFT | {"sample": 3}), r"setting sample: unknown; did you mean samples\?"),
        (untouched, settings("shift", shift=SHIFT | {"encoder": {"options": {}}}), r"setting encoder.options: unknown"),
        (untouched, settings("shift", shifts={}), r"setting shifts: unknown; known are shift, registrations, encoder"),
        (untouched, {"--other-registrations": ["registrations.npz"] * 2}, r"--other-registrations: 2 file\(s\) for 1"),
    ],
    "learners": [
        (removed("shifted.npz"), {}, r"shifted.npz: no such file; make it with 'python -m gpca shift'"),
        (arrays_changed("shifted.npz", h=lambda h: h * np.nan), {}, r"shifted.npz: array 'h' holds NaN"),
        (arrays_changed("shifted.npz", concept=lambda c: np.full_like(c, "pose")),
         {"--learners": ["learner_nearest", "gpca"]}, r"fewer than two concepts"),
        (untouched, settings("learners", gpca={"iteration": 5}), r"explainer 'gpca': .*iteration|setting iteration"),
        (untouched, {"--learners": ["gpca", "learner_oracle"]}, r"explainer 'learner_oracle': unknown"),
        (untouched, {"--learners": ["gpca", "residuals_forest"]}, r"'residuals_forest': does not read embeddings"),
        (untouched, {"--learners": ["gpca"]}, r"--out: 2 file\(s\), not 1; give one per learner and seed"),
        (untouched, {"--seeds": [0, 1]}, r"--sets: 1 file\(s\) for 2 seed\(s\)"),
    ],
    "label": [
        (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
        (removed("answers.txt"), {}, r"answers.txt: no such file; give a text file with an answer on each line"),
        (untouched, {"--known": ["noise"]}, r"starts with fewer than two labelled concepts; name two with --known"),
        (untouched, {"--strategy": "best"}, r"strategy 'best': unknown; known are random"),
        (written("labels.csv", "sample,split\n1,train\n"), {}, r"labels.csv: column 'concept' is missing"),
        (written("labels.csv", "sample,split,concept\n99,train,pose\n"), {}, r"labels.csv, line 2: no sample '99' of"),
        (written("labels.csv", "sample,split,concept\n9,train,\n9,train,pose\n"), {}, r"line 3: 'pose' contradicts ''"),
        (written("labels.csv", "sample,split,concept\n9,train,Not pose\n"), {}, r"'Not pose' is no name of a concept"),
    ],
    "model": [
        (removed("weights.pt"), {}, r"weights.pt: no such weights; make them anew with 'python -m gpca train'"),
        (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
        (untouched, {"--settings": {"encoder": {"layers": 3}}}, r"setting layers: unknown; known are backbone"),
        (untouched, {"--settings": {"gpc": {"kernel": "cubic"}}}, r"setting kernel: 'cubic' is not one of"),
        (untouched, {"--settings": {"registrations": {"icp": {"method": "x"}}}}, r"setting icp.method: 'x' is not"),
    ],
    "runtime": [
        (removed("model.pt"), {}, r"model.pt: no such model; make one with 'make results'"),
        (untouched, {"--settings": {"runtime": {"repeats": 1}}}, r"setting repeats: 1 is less than the minimum"),
        (untouched, {"--settings": {}}, r"leaves no pool of 18 training samples"),
    ],
    "explain": [
        (removed("model.pt"), {}, r"model.pt: no such model; make one with 'make results'"),
        (truncated("model.pt"), {}, r"model.pt: is damaged or no model"),
        (truncated("meshes/cone.ply"), {}, r"cone.ply: is truncated or not a readable .ply file"),
        (removed("meshes/brick.stl"), {}, r"brick.stl: no such file; give one of .ply"),
        (untouched, {"--unit": "m"}, r"mesh: object 'brick': its diameter is 128.5 m, so the declared unit"),
        (written("pose.txt", "1 0 0"), {"--init": "pose.txt"}, r"pose.txt: holds 3 numbers; give 4×4"),
        (untouched, {"--init": "pose.txt"}, r"pose.txt: no such file"),
        (untouched, {"--settings": {"draws": 3}}, r"--settings: explain has none"),
    ],
}  # fmt: skip
SAYS_MORE = {"label"}  # steps that speak to a person on stdout


@pytest.mark.parametrize(("step", "fault"), [(step, i) for step, faults in FAULTS.items() for i in range(len(faults))])
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, step, fault):
    spoil, changes, message = FAULTS[step][fault]
    spoil(folder)
    before = content(folder)
    assert main(arguments(step, changes)) == 2
    out, err = capsys.readouterr()
    line = err.splitlines()[-1]
    assert line.startswith(f"gpca {step}: ")
    assert re.search(message, line), line
    assert "Traceback" not in err
    assert out == "" or step in SAYS_MORE
    assert content(folder) == before


def test_an_explanation_is_on_stdout_and_what_led_to_it_on_stderr(folder, capsys):
    np.savetxt(folder / "pose.txt", np.eye(4))
    assert main(arguments("explain", {"--init": "pose.txt", "--uncertainty": []})) == 0
    out, err = capsys.readouterr()
    explanation = json.loads(out)
    assert set(explanation["scores"]) == set(explanation["variances"]) == {"noise", "pose", "overlap"}
    assert explanation["unit"] == "mm"
    assert explanation["spread"]["starts"] == 50
    assert explanation["trained_on"] == "Tiny (procedural stand-in)"
    assert "source: 128 of 16384 points, drawn at random\n" in err
    assert "model model.pt, trained on Tiny (procedural stand-in)\n" in err
    assert main(arguments("explain", {"--json": None})) == 0
    text = capsys.readouterr().out
    for word in ("concept", "action", "variance", "fitness", "T_target_source, in mm"):
        assert word in text


def test_the_model_holds_the_policy_of_the_config_with_a_threshold_of_its_own(folder, made):
    assert Model.load(made / "model.pt").policy.thresholds.uncertain > 0
    declared = STEP_OPTIONS["model"]["--settings"] | {
        "recovery": POLICY | {"thresholds": POLICY["thresholds"] | {"uncertain": 0.125}}
    }
    assert main(arguments("model", {"--settings": declared, "--out": "declared.pt"})) == 0
    policy = Model.load(folder / "declared.pt").policy
    assert policy == RecoveryPolicy(Thresholds(0.125, 0.4, 0.1, 3), POLICY["treatments"])


def test_a_model_made_anew_is_the_same_to_the_byte(folder, made):
    assert main(arguments("model")) == 0
    assert (folder / "model.pt").read_bytes() == (made / "model.pt").read_bytes()


@pytest.mark.parametrize(
    ("step", "changes", "message"),
    [
        ("objects", {"--data-dir": "nowhere"}, "gpca objects: nowhere: no such folder; correct data_dir in the config"),
        ("registrations", {"--objects": "lost.npz"}, "gpca registrations: lost.npz: no such file; make it with"),
        ("attribute", {"--explainer": "shapley"}, "gpca attribute: explainer 'shapley': unknown; known are"),
    ],
)
def test_the_process_ends_with_status_2_and_that_line_alone(folder, step, changes, message):
    done = subprocess.run(
        [sys.executable, "-m", "gpca", *arguments(step, changes)],
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith(message)


def _from(fault, cause):
    fault.__cause__ = cause
    return fault


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        (KeyboardInterrupt(), 130),
        (_from(SystemError(), KeyboardInterrupt()), 130),
        (_from(SystemError(), _from(SystemError(), KeyboardInterrupt())), 130),  # as numba raises it
        (_from(SystemError(), ValueError()), None),
        (SystemError(), None),
    ],
)
def test_ctrl_c_is_known_in_whatever_it_is_wrapped_and_nothing_else_is(monkeypatch, capsys, fault, status):
    def stopped(arguments, chosen):
        raise fault

    monkeypatch.setattr(command_line, "_run", stopped)
    if status is None:
        with pytest.raises(SystemError):
            main(["train"])
    else:
        assert main(["train"]) == status
        assert capsys.readouterr().err == "gpca train: stopped; the same command continues\n"


def test_ctrl_c_stops_a_training_that_then_continues_to_the_same_bytes(folder):
    longer = settings("train", epochs=30)
    assert main(arguments("train", longer | {"--out": "unbroken.pt"})) == 0
    # Where the tests run in the background of a shell, SIGINT is ignored, and children inherit that.
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from gpca.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, *arguments("train", longer)],
        env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while process.poll() is None and not (folder / "weights.checkpoint").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130, err
    assert err.splitlines()[-1] == "gpca train: stopped; the same command continues"
    assert "Traceback" not in err
    assert main(arguments("train", longer)) == 0
    assert (folder / "weights.pt").read_bytes() == (folder / "unbroken.pt").read_bytes()


def test_help_and_wrong_usage_need_no_heavy_library():
    code = (
        "import sys; from gpca.__main__ import main\n"
        "try: main(['--help'])\n"
        "finally: print({'torch', 'open3d', 'numpy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.endswith("set()\n")
    for step in STEPS:
        assert step in done.stdout


@pytest.mark.parametrize("step", [None, *STEPS])
def test_help_is_plain_text(capsys, step):
    with pytest.raises(SystemExit) as caught:
        main([step, "--help"] if step else ["--help"])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert out.startswith(f"usage: python -m gpca {step or ''}")
    assert not re.search(r"`|:\w+:|None", out), out


def test_the_command_goes_by_the_name_that_it_was_called_by(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/somewhere/bin/gpca"])
    with pytest.raises(SystemExit):
        main(["--help"])
    assert capsys.readouterr().out.startswith("usage: gpca [-h] [--version] step")


def test_the_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"gpca {gpca.__version__}\n"


@pytest.mark.parametrize("words", [[], ["nosuchstep"], ["train", "--seed", "one"], ["objects"]])
def test_wrong_usage_is_argparses_status_2(words, capsys):
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    assert "error:" in capsys.readouterr().err
