"""The step ``explain`` by hand, and what it says of faulty files and settings."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from gpca.model.location import SHIPPED
from tests.steps.by_words import main

from ..documents import ROOT
from .command_lines import arguments
from .spoiling import content, refused, removed, truncated, untouched, written

FAULTS = [
    (removed("model.pt"), {}, r"model.pt: no such model; make one with 'make results'"),
    (truncated("model.pt"), {}, r"model.pt: is damaged or not a model"),
    (truncated("meshes/cone.ply"), {}, r"cone.ply: is truncated or not a readable .ply file"),
    (removed("meshes/brick.stl"), {}, r"brick.stl: no such file; give one of .ply"),
    (
        untouched,
        {"--unit": "m"},
        r"cone.ply: its diameter is .* m, but objects span 1 mm to 10 m; is it in millimeters. give --unit mm",
    ),
    (untouched, {"--source-unit": "m"}, r"brick.stl: looks .* larger than the target; .* --source-unit mm --unit mm"),
    (written("pairs.csv", "source\na.ply\n"), {"--pairs": "pairs.csv"}, r"--pairs: has sources and targets of its own"),
    (written("pose.txt", "1 0 0"), {"--init": "pose.txt"}, r"pose.txt: contains 3 numbers; give 4×4"),
    (untouched, {"--init": "pose.txt"}, r"pose.txt: no such file"),
    (untouched, {"--method": "icp"}, r"explain: registration method 'icp': unknown; choose one of point_to_point, "),
    (untouched, {"--estimator": "gauss"}, r"explain: estimator 'gauss': unknown; choose one of .*brossard"),
    (untouched, {"--estimator": "cello"}, r"explain: estimator 'cello': learns from registrations"),
    (untouched, {"--estimator": ""}, r"--estimator: '' is empty or does not fit on one line"),
    (untouched, {"meshes/cone.ply": ["meshes/cone.ply"]}, r"explain: --json-lines: is needed for 2 sources; add it"),
    (untouched, {"--settings": {"draws": 3}}, r"--settings: is not used by explain"),
    (untouched, {"--html": "meshes/cone.ply"}, r"cone.ply: is also an input or another output"),
    (untouched, {"--png": "lost/../model.pt", "--model": "model.pt"}, r"model.pt: is also an input"),
    (untouched, {"--voxel": 0.1}, r"--voxel: is for scans alone; add --scans"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "explain", *FAULTS[fault])


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
    assert err.endswith(
        "model model.pt: the diagnosis learned from objects that the model file does not name; "
        "GP-CA as in the paper from Tiny (procedural stand-in)\n"
    )
    assert main(arguments("explain", {"--json": None})) == 0
    text = capsys.readouterr().out
    for word in ("action", "fitness", "T_target_source, in mm"):
        assert word in text
    assert "variance" not in text
    assert main(arguments("explain", {"--json": None, "--verbose": []})) == 0
    assert "variance" in capsys.readouterr().out


def test_a_diagnosis_says_what_it_rests_on_and_fast_that_it_rests_on_less(folder, capsys):
    assert main(arguments("explain", {})) == 0
    diagnosis = json.loads(capsys.readouterr().out)["diagnosis"]
    assert set(diagnosis["reenacted"]["effects"]) == {"noise", "pose", "overlap"}
    assert sum(pose["probability"] for pose in diagnosis["reenacted"]["poses"]) == pytest.approx(1)
    assert set(diagnosis["guarantee"]["states"]) <= {"nominal", "noise", "pose", "overlap", "several"}
    assert diagnosis["guarantee"]["level"] == 0.9
    assert diagnosis["guarantee"]["call"] in ("good", "not sure", "failed")
    assert main(arguments("explain", {"--fast": []})) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["diagnosis"]["guarantee"] is None
    assert json.loads(out)["diagnosis"]["reenacted"]["poses"]
    assert "fast: at most 384 points and 2 poses were re-enacted, and nothing is promised\n" in err
    assert main(arguments("explain", {"--json": None, "--verbose": []})) == 0
    text = capsys.readouterr().out
    starts = [line.split()[0] for line in text.splitlines() if line]
    labels = ["state", "result", "error", "start", "90%", "alarm", "guarantee", "causes", "effects", "observed", "pose"]
    assert [start for start in starts if start in labels][: len(labels)] == labels
    assert main(arguments("explain", {"--json": None, "--fast": []})) == 0
    assert "guarantee none: " in capsys.readouterr().out


# What loads for tenths of a second or more, and what of that an explanation by the model's own ICP needs.
HEAVY = {"torch", "numba", "scipy", "trimesh", "gpytorch", "sklearn", "pandas", "sympy", "open3d", "torch._dynamo"}
CODE = "import sys; from gpca.__main__ import main; print(main(sys.argv[1:]), *sys.modules, file=sys.stderr)"


def loaded_by(folder, *words):
    """Run a command in a process of its own, and return its exit status and the heavy modules that it loaded."""
    command = [sys.executable, "-c", CODE, *map(str, words)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    status, *modules = done.stderr.splitlines()[-1].split()
    return int(status), HEAVY & set(modules)


@pytest.mark.parametrize("fault", ["suffix", "header", "model", "pose"])
def test_a_file_that_cannot_be_used_is_refused_before_heavy_libraries_are_loaded(tmp_path, fault):
    source, options = tmp_path / "cloud.ply", ["--model", SHIPPED]
    if fault == "suffix":
        source = tmp_path / "cloud.abc"
    else:
        source.write_text("ply\nformat binary_middle_endian 1.0\nend_header\n")
    if fault == "model":
        options = ["--model", "lost.pt"]
    if fault == "pose":
        options += ["--init", "lost.txt"]
    assert loaded_by(tmp_path, "explain", source, source, *options) == (2, set())


def test_another_method_finds_the_pose_and_the_model_says_why(folder, capsys):
    assert main(arguments("explain", {"--method": "gicp"})) == 0
    explanation = json.loads(capsys.readouterr().out)
    assert explanation["method"] == "gicp"
    assert sum(explanation["scores"].values()) == pytest.approx(1)
    assert main(arguments("explain", {"--method": "gicp", "--json": None})) == 0
    assert "method    gicp: fitness " in capsys.readouterr().out


@pytest.mark.parametrize("form", ["", "--json", "--json-lines"])
def test_a_pair_without_meaning_has_a_status_of_its_own(folder, capsys, form):
    import trimesh

    trimesh.load(folder / "meshes/brick.stl").apply_translation((1000, 0, 0)).export(folder / "far.stl")
    sources = ["far.stl", "meshes/brick.stl"] if form == "--json-lines" else ["far.stl"]
    words = ["explain", *sources, "meshes/brick.stl", "--unit", "mm", "--model", "model.pt", *filter(None, [form])]
    assert main(words) == 3
    out, err = capsys.readouterr()
    if form:
        first, *rest = (json.loads(line) for line in out.splitlines())
        assert (first["diagnosis"]["state"], first["action"]) == ("unknown", "check")
        assert all(line["diagnosis"]["state"] != "unknown" for line in rest)
        assert "warning: no source point ended near the target, so the scores are meaningless" in err
    else:
        assert "state     unknown\naction    check what was given\nreason    the numbers mean nothing until " in out
        assert "checked: the initial pose and the unit\n" in out


def test_several_sources_are_a_line_each(folder, capsys):
    sources = ["meshes/brick.stl", "meshes/cone.ply"]
    words = ["explain", *sources, "meshes/cone.ply", "--unit", "mm", "--model", "model.pt", "--json-lines"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    lines = [json.loads(line) for line in out.splitlines()]
    assert [line["source"] for line in lines] == sources
    assert {line["target"] for line in lines} == {"meshes/cone.ply"}
    assert all(set(line["diagnosis"]["causes"]) == {"noise", "pose", "overlap"} for line in lines)
    assert "meshes/brick.stl: source: 128 of 16384 points, drawn at random\n" in err


def test_a_faulty_source_is_a_line_and_the_others_go_on(folder, capsys):
    (folder / "noise.ply").write_bytes(b"ply")
    sources = ["noise.ply", "meshes/brick.stl", "lost.ply", "meshes/cone.txt"]
    words = ["explain", *sources, "meshes/cone.ply", "--unit", "mm", "--model", "model.pt", "--json-lines"]
    assert main(words) == 2
    out, err = capsys.readouterr()
    lines = [json.loads(line) for line in out.splitlines()]
    assert {line["source"]: "error" in line for line in lines} == dict.fromkeys(sources, True) | {sources[1]: False}
    assert err.count("gpca explain: ") == 3
    assert main([*words[:2], "lost.ply", "lost.ply", "--json-lines"]) == 2
    assert capsys.readouterr().out == ""  # the target is no source


PAIRS = """source, target, init, unit
brick.stl,cone.ply,,mm
lost.ply,cone.ply,,mm

brick.stl,cone.ply,pose.txt,mm
brick.stl,cone.ply,short.txt,mm
brick.stl,cone.ply,,inch
,cone.ply
brick.stl,,,,more
brick.stl,cone.ply
"""


def test_pairs_of_a_file_are_a_line_each_and_a_faulty_row_loses_no_other(folder, capsys):
    meshes = folder / "meshes"
    (meshes / "pairs.csv").write_text(PAIRS)
    (meshes / "pose.txt").write_text("1 0 0 5  0 1 0 0  0 0 1 0")
    (meshes / "short.txt").write_text("1 0 0")
    words = ["explain", "--pairs", "meshes/pairs.csv", "--model", "model.pt", "--json-lines"]
    assert main(words) == 2
    out, err = capsys.readouterr()
    lines = [json.loads(line) for line in out.splitlines()]
    assert next(line["error"] for line in lines if "error" in line).startswith("meshes/lost.ply: no such file")
    assert len(lines) == 8
    lines = [line for line in lines if "error" not in line]
    assert [(line["source"], line["target"]) for line in lines] == [("meshes/brick.stl", "meshes/cone.ply")] * 2
    assert main([*arguments("explain", {"--init": "meshes/pose.txt"})]) == 0
    assert json.loads(capsys.readouterr().out)["T_target_source"] == lines[1]["T_target_source"]
    faults = [line for line in err.splitlines() if line.startswith("gpca explain: ")]
    expected = (
        (3, "meshes/lost.ply: no such file"),
        (6, "meshes/short.txt: contains 3 numbers"),
        (7, "unit 'inch': unknown; choose one of m, cm, mm"),
        (8, "source: is missing; name a file"),
        (9, "row: has more entries than columns"),
        (10, "meshes/cone.ply: its diameter is"),
    )
    assert len(faults) == len(expected)
    for fault, (number, words) in zip(faults, expected, strict=True):
        assert fault.startswith(f"gpca explain: meshes/pairs.csv, line {number}: {words}")


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        (None, ["--json-lines"], "pairs.csv: no such file"),
        ("", ["--json-lines"], "pairs.csv: is empty"),
        ("source,unit\na,b\n", ["--json-lines"], "pairs.csv: column 'target' is missing"),
        ("source,target\n", ["--json-lines"], "pairs.csv: has no rows"),
        ("source,target,target\na,b,c\n", ["--json-lines"], "pairs.csv: column 'target' occurs twice"),
        ("source,target\na\0,b\n", ["--json-lines"], "pairs.csv, line 2: has a zero byte"),
        ("source,target,x\na,b,c\n", [], "--pairs: prints one line for each pair; add --json-lines"),
        ("source,target\na,b\n", ["--json-lines", "--init", "a"], "--init: is not for --pairs"),
        ("source,target\na,b\n", ["--json-lines", "--html", "a"], "--html: is not for --pairs"),
    ],
)
def test_a_file_without_pairs_is_one_line(folder, capsys, text, words, message):
    if text is not None:
        (folder / "pairs.csv").write_text(text)
    assert main(["explain", "--pairs", "pairs.csv", "--model", "model.pt", *words]) == 2
    out, err = capsys.readouterr()
    assert not out
    assert f"gpca explain: {message}" in err


def test_source_and_target_may_have_units_of_their_own(folder, capsys):
    import trimesh

    assert main(arguments("explain", {})) == 0
    expected = json.loads(capsys.readouterr().out)
    trimesh.load(folder / "meshes/brick.stl").apply_scale(1e-3).export(folder / "meshes/brick.stl")
    assert main(arguments("explain", {"--source-unit": "m"})) == 0
    explanation = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(explanation["T_target_source"], expected["T_target_source"], atol=1e-3)
    assert explanation["unit"] == "mm"


def test_page_and_figure_are_written_beside_the_text(folder, capsys):
    assert main(arguments("explain", {"--json": None, "--html": "out/page.html", "--png": "figure.png"})) == 0
    out, err = capsys.readouterr()
    assert "state     " in out
    assert "page out/page.html\nfigure figure.png\n" in err
    page = (folder / "out/page.html").read_text()
    assert "<dt>Source</dt><dd>meshes/brick.stl</dd>" in page
    assert "T_target_source" in page
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_limits_are_set_on_labeled_pairs_and_a_pose_of_a_row_is_judged_as_it_is(folder, capsys):
    poses = [f"1 0 0 {shift}  0 1 0 0  0 0 1 0" for shift in range(4)]
    rows = ["source,target,pose,init,label,group"]
    for number, (text, label) in enumerate(zip(poses, ("right", "noise", "right", "several"), strict=True)):
        (folder / f"{number}.txt").write_text(text)
        column = f"{number}.txt," if number % 2 else f",{number}.txt"
        rows.append(f"meshes/brick.stl,meshes/cone.ply,{column},{label},scene {number % 2}")
    (folder / "pairs.csv").write_text("\n".join(rows))
    words = ["calibrate", "pairs.csv", "--model", "model.pt", "--unit", "mm"]
    assert main([*words, "--out", "mine.pt"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("labeled   2 right and 2 wrong in 2 groups, within 3 % of the diameter\nmissed    not yet: ")
    assert err.endswith("calibrated on 4 labeled registrations\n")
    assert main(["explain", "--pairs", "pairs.csv", "--model", "mine.pt", "--unit", "mm", "--json-lines"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["method"] == "given" for line in lines] == [False, True] * 2
    assert lines[3]["T_target_source"][0][3] == 3
    assert all(line["diagnosis"]["guarantee"]["labeled"] for line in lines)
    before = content(folder)
    for spoiled, fault in (
        (rows[:2], "labels: are all right; label some"),
        ([*rows, rows[1]], "pairs.csv, line 6: is the registration of pairs.csv, line 2; label each"),
        (
            [rows[0], "lost.ply,meshes/cone.ply,,,right,", "a.ply,b.ply,,,wrong,"],
            "pairs.csv, line 2: lost.ply: no such",
        ),
        ([*rows, "a.ply,b.ply,0.txt,0.txt,right,c"], "pairs.csv, line 6: pose: is judged as it is, without init or"),
        (["source,target", "a,b"], "pairs.csv: column 'label' is missing"),
    ):
        (folder / "pairs.csv").write_text("\n".join(spoiled))
        assert main([*words, "--out", "other.pt"]) == 2
        assert capsys.readouterr().err.splitlines()[-1].startswith(f"gpca calibrate: {fault}")
    assert main([*words, "--out", "model.pt"]) == 2
    assert content(folder) == before | {"pairs.csv": content(folder)["pairs.csv"]}
