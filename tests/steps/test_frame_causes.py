"""The steps of frames' causes by hand, what is collected of them, and what they say of faulty files and settings."""

import json

import pandas as pd
import pytest

from gpca.causes.dataset import LABELS, Causes
from gpca.causes.truth import BORDERLINE, GEOMETRY
from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.experiments.frame_causes import STATE, TRUTH, collect, table9_frames
from tests.experiments.runs import run_with
from tests.steps.by_words import main

from ..hostile import refusal
from .command_lines import CAUSES, ENCODER

FEW = {"iterations": 5, "inducing": 6, "draws": 20}
SETTINGS = {
    "frames": {"starts": 6, "points": 128, "rungs": [[20, 0.1]]},
    "causes": CAUSES,
    "icp": {"max_iterations": 30},
    "descriptors": {"starts": 1, "restarts": 2, "icp_points": 64},
    "reenactment": {"hypotheses": 2},
    "encoder": ENCODER,
    "explainers": {"gpca": FEW, "gpca_pair": FEW, "gate_rmse": {}, "reenact": {}},
}


@pytest.fixture(scope="module")
def calls(made, tiny, scenes, tmp_path_factory):
    """A folder with what the steps read, and their command lines there, by name."""
    folder = tmp_path_factory.mktemp("frames")
    tiny[0].save(folder / "instances.npz", ("tiny", None))
    tiny[1].save(folder / "objects.npz", "tiny")
    datasets = {"tiny": {"location": str(scenes)}}
    common = ["--source", "tiny", "--seed", "100", "--settings", json.dumps(SETTINGS | {"datasets": datasets})]
    frames = [*common, "--instances", "instances.npz", "--objects", "objects.npz"]
    measured = ["--frame-causes", "seed100.npz"]
    starts = ["--starts", "starts.npz"]
    lessons = {"causes": "causes", "descriptors": "descriptors", "cause_embeddings": "embeddings"}
    lessons |= {"reenactments": "reenactments"}
    learned = [word for name, option in lessons.items() for word in (f"--{option}", made / f"{name}.npz")]
    learned += ["--encoders", made / "cause_weights.pt", "--frame-reenactments", "reenactments.npz"]
    words_of = {
        "frame_causes": [*frames, *measured, *starts, "--samples", "seed100.csv"],
        "reenact_frames": [*frames, *measured, *starts, "--reenactments", "reenactments.npz"],
        "diagnose_frames": [*common, *measured, *learned, "--predictions", "said.csv"],
    }
    return folder, {step: [step, *map(str, words)] for step, words in words_of.items()}


@pytest.fixture(scope="module")
def asked(calls):
    folder, words_of = calls
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert [main(words) for words in words_of.values()] == [0, 0, 0]
    return tuple([folder / name] for name in ("seed100.npz", "seed100.csv", "said.csv"))


def test_every_explainer_is_judged_on_the_frames(asked):
    causes = Causes.load(asked[0][0])
    assert len(causes) == 6
    assert set(causes.registrations.split) == {"test"}
    rows = collect(None, *asked)
    counts = rows[(rows["method"] == TRUTH) & (rows["source"] == "real_rgbd/ladder")]
    counts = dict(zip(counts["metric"], counts["value"], strict=True))
    assert sum(counts[f"count_{state}"] for state in (*LABELS, BORDERLINE, GEOMETRY)) == 6
    assert counts["count_starts"] == 6
    samples = pd.read_csv(asked[1][0])
    off = samples[[f"failed_{name}" for name in ("point_to_point", "point_to_plane", "gicp")]]
    assert off["failed_point_to_point"].tolist() == (causes.error_shown > CAUSES["limits"]["failed"]).tolist()
    assert [counts[f"count_{name}"] for name in off] == off.sum().tolist()
    assert counts["count_failures"] == off.to_numpy().sum()
    assert counts["count_failed_scenes"] == samples["scene"][off.any(axis=1)].nunique()
    assert set(rows["method"]) <= {TRUTH, "ceiling", *SETTINGS["explainers"]}
    both = counts["count_nominal"] and any(counts[f"count_{kind}"] for kind in ("noise", "pose", "overlap"))
    assert bool(both) == (STATE in set(rows["metric"]))


def test_a_scene_counts_as_one_and_an_instance_once(asked, tmp_path):
    """Each sample a second time, as the start of another estimator: values and intervals stay."""
    once = collect(None, *asked)
    again = [tmp_path / path.name for [path] in asked]
    for [path], copy in zip(asked, again, strict=True):
        copy.write_bytes(path.read_bytes())
    twice = collect(None, *([path, copy] for [path], copy in zip(asked, again, strict=True)))
    measured = [rows[rows["method"] != TRUTH].reset_index(drop=True) for rows in (once, twice)]
    columns = ["against", "other", "value", "low", "high"]
    kept = measured[0]["metric"] != "test_samples"
    pd.testing.assert_frame_equal(measured[0].loc[kept, columns], measured[1].loc[kept, columns])


def test_scenes_whose_truth_icp_made_are_counted_and_measure_nothing(asked, tmp_path):
    samples = tmp_path / "seed100.csv"
    samples.write_text(asked[1][0].read_text().replace("annotated", "icp"))
    rows = collect(None, asked[0], [samples], asked[2])
    assert set(rows["method"]) == {TRUTH}
    assert set(rows["source"]) == {"real_rgbd/pseudo_truth", "real_rgbd/pseudo_truth/tiny"}


def test_the_table_says_how_few_there_are(asked):
    frames = with_defaults({})["real_world"] | {"title": "Tiny", "datasets": {}}
    diagnosis = with_defaults({})["diagnosis"] | {"explainers": SETTINGS["explainers"]}
    table = table9_frames(run_with(real_world=frames, diagnosis=diagnosis), collect(None, *asked))
    assert "6 starts of" in table.footnotes[0]
    assert "too few" in table.rows[0][0][1]
    assert "procedural stand-in" in table.caption


def test_files_of_other_samples_are_refused(asked, tmp_path):
    fewer = tmp_path / "seed100.csv"
    fewer.write_text("".join(asked[1][0].open().readlines()[:-1]))
    with pytest.raises(InputError, match="its samples differ from those of the causes"):
        collect(None, asked[0], [fewer], asked[2])


@pytest.mark.parametrize(
    ("step", "option", "value", "words"),
    [
        ("frame_causes", "--instances", ["objects.npz"], "objects.npz: array"),
        (
            "frame_causes",
            "--settings",
            [json.dumps(SETTINGS | {"datasets": {"tiny": {"location": "/not/there"}}})],
            "/not/there does not exist",
        ),
        ("frame_causes", "--frame-causes", ["objects.npz"], "objects.npz"),
        ("reenact_frames", "--starts", ["objects.npz"], "objects.npz: array 'instance' is missing"),
        ("reenact_frames", "--frame-causes", ["lost.npz"], "lost.npz: no such file"),
        ("diagnose_frames", "--frame-reenactments", ["instances.npz"], "instances.npz: array"),
    ],
)
def test_a_fault_is_one_line_and_harms_nothing(calls, asked, step, option, value, words):
    folder, line = calls[0], calls[1][step]
    at = line.index(option)
    refusal([*line[: at + 1], *value, *line[at + 2 :]], folder, words)
