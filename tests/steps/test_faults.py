"""Faults of what each step reads, and of the rare settings that only the data prove wrong: one line, no harm done."""

import numpy as np
import pytest

from .command_lines import STEP_OPTIONS, settings
from .spoiling import arrays_changed, lines_kept, pickled, refused, removed, truncated, untouched, written


def one_object(folder):
    with np.load(folder / "objects.npz") as archive:
        arrays = dict(archive)
    rows = slice(0, arrays["offsets"][1])
    chosen = {name: arrays[name][:1] for name in ("names", "diameters_m", "families", "folds")}
    chosen |= {name: arrays[name][rows] for name in ("points_m", "normals")} | {"offsets": arrays["offsets"][:2]}
    np.savez(folder / "objects.npz", **arrays | chosen)


def nan(array):
    return array * np.nan


def later(sample):
    return sample + 50


def reversed_order(array):
    return array[::-1]


def section(step, name, **changed):
    return settings(step, **{name: STEP_OPTIONS[step]["--settings"][name] | changed})


ANOTHER_NAME = r"object(s of tiny: object)? \d is not '\w+'"
NO_ARCHIVE = "is not a readable npz archive"
NOT_THE_WEIGHTS = "weights.pt: not the weights of backbone 'dgcnn'"
OTHER_SAMPLES = "its samples differ from those of the"
OTHER_TIMES = "causes_timings.csv: its samples differ from those of the registrations"
FOLDER = {"title": "T", "kind": "ply_folder", "location": "x", "scenes": "room"}
SHAP = {
    "--explainer": "shap_removal", "--settings": {}, "--embeddings": None, "--uncertainty": "uncertainty.npz",
    "--uncertainty-timings": "uncertainty_timings.csv", "--input-timings": "icp.csv",
}  # fmt: skip
FAULTS = {
    "objects": [
        (untouched, settings("objects", location="nowhere"), "'mesh_folder': nowhere does not exist; correct"),
        (lambda folder: (folder / "empty").mkdir(), settings("objects", location="empty"), "the folder has none of"),
        (truncated("meshes/cone.ply"), {}, "cone.ply: is truncated or not a readable .ply file"),
        (untouched, settings("objects", unit="m"), "object 'brick': its diameter is 128.5 m, but objects span"),
        (untouched, {"--out": "meshes/brick.stl/objects.npz"}, "meshes/brick.stl"),
    ],
    "registrations": [
        (pickled("objects.npz"), {}, "objects.npz: contains pickled objects, which are never loaded"),
        (arrays_changed("objects.npz", normals=lambda n: n[1:]), {}, "array 'normals' is 1199×3, not 1200×3"),
    ],
    "causes": [
        (untouched, {"--objects": "nowhere.npz"}, "nowhere.npz: no such file"),
        (one_object, {}, "causes of tiny: has objects of one family alone, which cannot be split"),
    ],
    "describe": [
        (untouched, {"--causes": "registrations.npz"}, "registrations.npz: array"),
        (lines_kept("causes_timings.csv", 3), {}, OTHER_TIMES),
    ],
    "draw_scans": [
        (untouched, settings("draw_scans", entry={"title": "T", "kind": "npz", "location": "x"}), "T: its data is not"),
        (untouched, {"--place": "nowhere", **settings("draw_scans", entry=FOLDER)}, "nowhere/poses.txt: no such file"),
    ],
    "register_scans": [
        (truncated("scans.npz"), {}, f"scans.npz: {NO_ARCHIVE}"),
        (arrays_changed("scans.npz", offsets=later), {}, "scans.npz: 'offsets' do not match 'points'"),
    ],
    "estimate": [(arrays_changed("objects.npz", names=reversed_order), {}, ANOTHER_NAME)],
    "train_on_causes": [
        (untouched, {"--causes": "registrations.npz"}, "registrations.npz: array"),
        (lines_kept("causes_timings.csv", 3), {}, OTHER_TIMES),
    ],
    "diagnose": [
        (untouched, {"--read": "registrations.npz"}, "registrations.npz: array"),
        (arrays_changed("descriptors.npz", sample=reversed_order), {}, "descriptors.npz: its samples differ"),
        (arrays_changed("descriptors.npz", motion=nan), {}, "array 'motion' contains NaN"),
        (untouched, {"--explainer": "gpca", "--read": "descriptors.npz"}, "descriptors.npz: array 'h' is missing"),
    ],
    "learning_curve": [
        (arrays_changed("descriptors.npz", motion=nan), {}, "array 'motion' contains NaN"),
        (untouched, {"--samples": "causes.npz"}, "causes.npz: array 'distances' is missing"),
        (
            untouched,
            section("learning_curve", "learning_curve", sizes=[900]),
            "training samples of other families are fewer than the least size, 900",
        ),
    ],
    "register_methods": [
        (arrays_changed("objects.npz", names=reversed_order), {}, ANOTHER_NAME),
        (
            untouched,
            section("register_methods", "method_pairs", global_start="teaser"),
            "global_start: 'teaser' is not among the methods",
        ),
        (
            untouched,
            section("register_methods", "method_pairs", global_start="point_to_point"),
            "'point_to_point': needs an initial pose",
        ),
    ],
    "train": [
        (arrays_changed("registrations.npz", concept=lambda c: np.full_like(c, "x")), {}, "unknown concept 'x'"),
        (untouched, settings("train", draw_points=129), r"the largest cloud has \d+ points, fewer than draw_points"),
    ],
    "embed": [
        (removed("weights.pt"), {}, "weights.pt: no such weights"),
        (truncated("weights.pt"), {}, NOT_THE_WEIGHTS),
        (untouched, settings("embed", options={"k": 8}), NOT_THE_WEIGHTS),
        (written("icp.csv", ""), {}, "icp.csv: is empty"),
        (written("icp.csv", 'sample,"split\n1'), {}, "icp.csv: is not a readable CSV file"),
        (written("icp.csv", "sample,split,seconds,icp_seconds\n0,train,1,1\n"), {}, "icp.csv: its samples differ"),
    ],
    "controls": [
        (arrays_changed("control.npz", sample=later), {}, "control.npz: its samples differ"),
        (arrays_changed("registrations.npz", fitness=lambda f: f - 2), {}, "'fitness' contains impossible values"),
    ],
    "exchange": [
        (removed("weights.pt"), {}, "weights.pt: no such weights"),
        (arrays_changed("objects.npz", names=reversed_order), {}, ANOTHER_NAME),
    ],
    "reduce": [
        (arrays_changed("embeddings.npz", h=nan), {}, "array 'h' contains NaN"),
        (arrays_changed("embeddings.npz", h=np.ones_like), {}, "training embeddings: are all identical"),
        (untouched, settings("reduce", components=19), "19 components are too many for 18 training embeddings of 32"),
    ],
    "attribute": [
        (arrays_changed("uncertainty.npz", sample=later), SHAP, "its samples differ"),
        (lines_kept("uncertainty_timings.csv", 20), SHAP, "its samples differ"),
        (arrays_changed("embeddings.npz", sample=later), {}, OTHER_SAMPLES),
        (arrays_changed("embeddings.npz", h=lambda h: h[:, 0]), {}, "array 'h' is 24, not S×d"),
        (arrays_changed("embeddings.npz", h=lambda h: h[1:]), {}, "array 'head_logits' is 24×3, not 23"),
        (written("dgcnn.csv", "sample,seconds\n"), {}, "dgcnn.csv: column 'split' is missing"),
    ],
    "active_learning": [
        (arrays_changed("without.npz", sample=later), {}, f"without.npz: {OTHER_SAMPLES}"),
        (arrays_changed("embeddings.npz", sample=later), {}, f"embeddings.npz: {OTHER_SAMPLES}"),
        (untouched, settings("active_learning", held_out=["noise", "pose"]), "array 'h_pose' is missing"),
        (untouched, settings("active_learning", initial=18), "leaves none of 18 training samples for the pool; lower"),
        (untouched, settings("active_learning", stream={"arrivals": 60, "quiet": 2}), "stream of 60 arrivals: needs"),
    ],
    "frame_labels": [
        (arrays_changed("embeddings.npz", sample=later), {}, f"embeddings.npz: {OTHER_SAMPLES}"),
        (untouched, settings("frame_labels", frame_labels={"initial": 18}), "leaves none of 18 training samples"),
    ],
    "kernel_grid": [(arrays_changed("embeddings.npz", h=nan), {}, "embeddings.npz: array 'h' contains NaN")],
    "shift": [
        (removed("weights.pt"), {}, "weights.pt: no such weights"),
        (arrays_changed("embeddings.npz", sample=later), {}, f"embeddings.npz: {OTHER_SAMPLES}"),
    ],
    "learners": [
        (
            arrays_changed("shifted.npz", concept=lambda c: np.full_like(c, "pose")),
            {"--learners": ["learner_nearest", "gpca"]},
            "fewer than two concepts",
        )
    ],
    "model": [
        (removed("weights.pt"), {}, "weights.pt: no such weights"),
        (arrays_changed("reenactments.npz", sample=later), {}, "reenactments.npz: its samples differ"),
    ],
    "runtime": [(removed("model.pt"), {}, "model.pt: no such model; make one with 'make results'")],
}


@pytest.mark.parametrize(
    ("step", "fault"), [pytest.param(step, fault, id=step) for step, faults in FAULTS.items() for fault in faults]
)
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, step, fault):
    refused(folder, capsys, step, *fault)
