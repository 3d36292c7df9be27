"""The step ``frame_causes`` by hand, what is collected of it, and what it says of faulty files and settings."""

import json

import pytest

from gpca.causes.dataset import LABELS, Causes
from gpca.errors import InputError
from gpca.experiments.diagnosis.tables import table9_frames
from gpca.experiments.frame_causes.metrics import KINDS, STATE, TRUTH, collect
from tests.steps.by_words import main

from ..hostile import refusal
from .command_lines import CAUSES, ENCODER

FEW = {"iterations": 5, "inducing": 6, "draws": 20}
SETTINGS = {
    "frames": {"instances": 6, "points": 128},
    "causes": CAUSES,
    "icp": {"max_iterations": 30},
    "descriptors": {"starts": 1, "restarts": 2, "icp_points": 64},
    "encoder": ENCODER,
    "explainers": {"gpca": FEW, "gpca_pair": FEW, "gate_rmse": {}},
}


@pytest.fixture(scope="module")
def call(made, tiny, scenes, tmp_path_factory):
    """A folder with what the step reads, and its command line there."""
    folder = tmp_path_factory.mktemp("frames")
    tiny[0].save(folder / "instances.npz", "tiny")
    tiny[1].save(folder / "objects.npz", "tiny")
    lessons = {"causes": "causes", "descriptors": "descriptors", "cause_embeddings": "embeddings"}
    datasets = {"tiny": {"location": str(scenes)}}
    words = ["--source", "tiny", "--seed", "100", "--settings", json.dumps(SETTINGS | {"datasets": datasets})]
    words += ["--instances", "instances.npz", "--objects", "objects.npz", "--encoders", made / "cause_weights.pt"]
    for name, option in lessons.items():
        words += [f"--{option}", made / f"{name}.npz"]
    outputs = {"--frame-causes": "seed100.npz", "--samples": "seed100.csv", "--predictions": "said.csv"}
    words += [word for pair in outputs.items() for word in pair]
    return folder, ["frame_causes", *map(str, words)]


@pytest.fixture(scope="module")
def asked(call):
    folder, words = call
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(words) == 0
    return tuple([folder / name] for name in ("seed100.npz", "seed100.csv", "said.csv"))


def test_every_explainer_is_judged_on_the_frames(asked):
    causes = Causes.load(asked[0][0])
    assert len(causes) == 6
    assert set(causes.registrations.split) == {"test"}
    rows = collect(*asked)
    counts = rows[(rows["method"] == TRUTH) & (rows["source"] == "real_rgbd")]
    counts = dict(zip(counts["metric"], counts["value"], strict=True))
    assert sum(counts[f"count_{kind}"] for kind in KINDS[:-2]) == 6
    assert set(rows["method"]) <= {TRUTH, "ceiling", *SETTINGS["explainers"]}
    both = counts["count_nominal"] and any(counts[f"count_{kind}"] for kind in ("noise", "pose", "overlap"))
    assert bool(both) == (STATE in set(rows["metric"]))


def test_instances_from_other_initial_poses_have_a_name_of_their_own_and_the_draws_of_the_frames(call, asked, tiny):
    folder, words = call
    tiny[0].save(folder / "estimated.npz", "tiny_estimated")
    tiny[1].save(folder / "their_objects.npz", "tiny_estimated")
    renamed = {"instances.npz": "estimated.npz", "objects.npz": "their_objects.npz", "said.csv": "said_too.csv"}
    renamed |= {"seed100.npz": "other.npz", "seed100.csv": "other.csv"}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main([renamed.get(word, word) for word in words] + ["--name", "tiny_estimated"]) == 0
    assert (folder / "said_too.csv").read_bytes() == (folder / "said.csv").read_bytes()


def test_the_table_says_how_few_there_are(asked):
    titles = {name: name for name in SETTINGS["explainers"]}
    costs = {name: {"sees": "pair", "icp_calls": 0} for name in titles}
    table = table9_frames(collect(*asked), {"title": "Tiny", "stand_in": True}, titles, costs)
    assert "Of 6 registrations" in table.footnotes[0]
    assert "procedural stand-in" in table.caption
    judged = collect(*asked)["metric"].isin([f"count_{kind}" for kind in LABELS])
    of_all = collect(*asked)[judged]
    assert table.cells[0, "samples"].mean == of_all.loc[of_all["source"] == "real_rgbd", "value"].sum()


def test_files_of_other_samples_are_refused(asked, tmp_path):
    fewer = tmp_path / "seed100.csv"
    fewer.write_text("".join(asked[1][0].open().readlines()[:-1]))
    with pytest.raises(InputError, match="its samples differ from those of the causes"):
        collect(asked[0], [fewer], asked[2])
    with pytest.raises(InputError, match="need files of every seed"):
        collect([], [], [])


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--instances", ["objects.npz"], "objects.npz: array"),
        (
            "--settings",
            [json.dumps(SETTINGS | {"datasets": {"tiny": {"location": "/not/there"}}})],
            "/not/there does not exist",
        ),
        ("--frame-causes", ["objects.npz"], "objects.npz"),
    ],
)
def test_a_fault_is_one_line_and_harms_nothing(call, asked, option, value, words):
    folder, line = call
    at = line.index(option)
    refusal([*line[: at + 1], *value, *line[at + 2 :]], folder, words)
