"""Configs that nobody should get into a run: each is refused in one line, by the command and by Snakemake's loading."""

import os

import pytest
import yaml

from gpca.config.layers import with_defaults
from gpca.io.structured_text import LARGEST_CONFIG_BYTES

from ..hostile import refusal
from .configs import load


def unfolding(first, line, depth=6):
    """A YAML bomb: every line holds the one before ten times."""
    return "\n".join([f"a0: &a0 {first}", *(f"a{i}: &a{i} {line(f'*a{i - 1}')}" for i in range(1, depth + 1))])


TEXTS = {
    "bomb of lists": (unfolding("[x]", lambda a: f"[{', '.join([a] * 10)}]"), "expand"),
    "bomb of mappings": (
        unfolding("{x: 1}", lambda a: "{" + ", ".join(f"k{i}: {a}" for i in range(10)) + "}"),
        "expand",
    ),
    "bomb of merges": (unfolding("{x: 1}", lambda a: f"{{<<: [{', '.join([a] * 10)}]}}", 9), "expand"),
    "alias to itself": ("registrations: &r {icp: *r}", "line 1", "contains itself"),
    "list in itself": ("seeds: &s [0, *s]", "line 1", "contains itself"),
    "merge of itself": ("encoders: &e\n  <<: *e\n", "contains itself"),
    "nested lists": ("seeds: " + "[" * 3000 + "]" * 3000, "nested too deeply"),
    "nested JSON": ('{"seeds": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
    "key twice": ("seeds: [0]\nrun: a\nseeds: [1]", "line 3: key 'seeds' appears twice"),
    "nested key twice": ("registrations:\n  train: 36\n  train: 90\n", "line 3: key 'train' appears twice"),
    "key twice in JSON": ('{"seeds": [0], "seeds": [1]}', "key 'seeds' appears twice"),
    "empty": ("", "is empty"),
    "list": ("- 1\n- 2\n", "no keys"),
    "text": ("hello", "no keys"),
    "unclosed": ("seeds: [0, 1", "neither YAML nor JSON"),
    "tab": ("registrations:\n\ttrain: 36\n", "neither YAML nor JSON", "line 2"),
    "two documents": ("seeds: [0]\n---\nseeds: [1]\n", "neither YAML nor JSON"),
    "unknown alias": ("seeds: *none", "undefined alias"),
    "NUL": ("seeds: [0]\0", "neither YAML nor JSON"),
    "code by a tag": ("run: !!python/object/apply:os.system ['touch here']", "neither YAML nor JSON"),
    "code by a template": ("__use_yte__: true\nrun: ?open('here', 'w').name\n", "__use_yte__"),
    "invalid date": ("run: 2024-13-45", "neither YAML nor JSON"),
    "endless digits": ("seeds: [" + "9" * 5000 + "]", "neither YAML nor JSON"),
    "date": ("run: 2024-01-01", "run", "is a date"),
    "bytes": ("run: !!binary aGVsbG8=", "run", "is a bytes"),
    "set": ("seeds: !!set {0, 1}", "seeds", "is a set"),
    "number as name": ("sources: {1: {title: x, kind: procedural, family: ycb}}", "sources.1", "is not text"),
    "switch as name": ("encoders: {on: {backbone: dgcnn}}", "line 1: YAML 1.1 reads on as True", '"on" in quotes'),
    "number in base 60": ("run: a\nseeds: [12:30]", "line 2: YAML 1.1 reads 12:30 as 750; write 750"),
    "decimals in base 60": ("registrations: {severities: {rotation_deg: [1:30.5, 60]}}", "reads 1:30.5 as 90.5"),
    "octal": ("seeds: [010]", "reads 010 as 8; write 8"),
    "binary": ("seeds: [0b11]", "reads 0b11 as 3; write 3"),
    "underlined": ("registrations: {train: 1_000}", "reads 1_000 as 1000; write 1000"),
    "no": ("sources: {ycb: no}", "reads no as False; write false"),
    "number in base 60 by a tag": ('seeds: [!!int "12:30"]', "reads 12:30 as 750"),
    "number in base 60 as name": ("encoders: {1:30: {backbone: dgcnn}}", "reads 1:30 as 90"),
    "nothing as name": ("learners: {~: {}}", "learners.None", "is not text"),
    "list as name": ("? [a, b]\n: 1\n", "neither YAML nor JSON"),
    "too long": ("#" * (LARGEST_CONFIG_BYTES + 1), "more than the limit of 0.262 MB"),
}


BYTES = {
    "Latin-1": ('figures: {source: "café"}'.encode("latin-1"), "UTF-8"),
    "UTF-16": ("seeds: [0]".encode("utf-16"), "UTF-8"),
    "all bytes": (bytes(range(256)), "UTF-8"),
    "surrogates": (b'{"run": "\\ud800"}', "run", "control character"),
}


@pytest.mark.parametrize("name", TEXTS | BYTES)
def test_what_is_no_sound_config(tmp_path, name):
    content, *words = (TEXTS | BYTES)[name]
    (tmp_path / "mine.yaml").write_bytes(content.encode() if isinstance(content, str) else content)
    refusal(["check-config", "mine.yaml"], tmp_path, "mine.yaml", *words)


@pytest.mark.parametrize("path", ["missing.yaml", "folder", "/dev/zero", "/dev/null", "missing/mine.yaml"])
def test_what_is_no_file(tmp_path, path):
    (tmp_path / "folder").mkdir()
    refusal(["check-config", path], tmp_path, path, "no")


def source(**more):
    return {"sources": {"mine": {"title": "Mine", "kind": "mesh_folder", "location": "parts", "unit": "mm"} | more}}


def frames(**more):
    return {"real_world": {"datasets": {"mine": {"location": "parts", "split": "parts"} | more}}}


VALUES = [
    ({"scans": {"datasets": {"mine": {"title": "t", "kind": "npz", "location": "/"}}}}, "is the root of the file"),
    (source(location="/"), "sources.mine", "is the root of the file system"),
    (source(files=["*.none"]), "sources.mine", "*.none: no file matches"),
    # the run's own folder
    ({"run": "smoke\n"}, "run", "control character"),
    ({"run": "reference"}, "run", "choose another name"),
    ({"run": "x" * 101}, "run", "at most 100"),
    # sizes that cannot be
    ({"registrations": {"train": 10**6, "cloud_points": 65536}}, "registrations.train", "GiB"),
    ({"real_world": {"test": 10**6}, "registrations": {"cloud_points": 65536}}, "real_world.train", "GiB"),
    ({"causes": {"train": 10**6, "points": [64, 65536]}}, "causes.train", "GiB", "lower causes.points"),
    ({"causes": {"points": [1024, 128]}}, "causes: causes points", "descending"),
    ({"success": {"error": 0.01}}, "nominal 0.02 exceeds failed 0.01"),
    ({"causes": {"limits": {"failed": 0.05}}}, "causes.limits.failed", "set success.error"),
    ({"model": {"causes": {"limits": {"failed": 0.05}}}}, "model.causes.limits.failed", "set success.error"),
    ({"success": {"curve": [0.05, 0.02]}}, "success curve", "ascending"),
    ({"causes": {"shares": {"geometry": 0.5}}}, "causes shares", "add up to 1.5"),
    # controls
    ({"controls": {"draw_points": [512, 200]}}, "controls: setting draw_points", "descending"),
    ({"controls": {"explainers": {"gpca_pair_dgcnn": {"epochs": 0}}}}, "controls.explainers.gpca_pair_dgcnn", "epochs"),
    ({"controls": {"explainers": {"shap_removal": {}}}}, "controls.explainers.shap_removal", "more Monte-Carlo ICP"),
    ({"controls": {"explainers": {"nobody": False}}}, "controls.explainers", "no explainer 'nobody'"),
    # more than there are samples or points
    ({"reductions": {"pca": {"components": 200}}}, "reductions.pca", "200 components are too many for 120 training"),
    (
        {"reductions": {"pca": {"components": 600}}, "real_world": {"train": 900}},
        *("reductions.pca", "600 components are too many for 900 training embeddings of 512 numbers"),
    ),
    ({"reductions": {"umap": {"neighbours": 120}}}, "reductions.umap", "120 neighbours are too many for 120 training"),
    ({"learners": {"learner_nearest": {"neighbours": 241}}}, "learners.learner_nearest.neighbours", "240 training"),
    ({"shift": {"neighbours": 241}}, "shift.neighbours", "241 neighbors are too many for 240 training samples"),
    ({"explainers": {"analytical_gpc": {"neighbours": 2049}}}, "explainers.analytical_gpc.neighbours", "2048 points"),
    ({"encoders": {"dgcnn": {"options": {"k": 513}}}}, "513 neighbors are too many for draws of 512 points"),
    ({"encoders": {"pointnet": {"draw_points": 4096}}}, "encoders.pointnet", "clouds that have at most 2048", "lower"),
    ({"registrations": {"cloud_points": 400}}, "encoders.dgcnn", "draws 512 points", "raise registrations.cloud_"),
    ({"diagnosis": {"encoder": {"draw_points": 2048}}}, "diagnosis.encoder", "at most 1024", "raise causes.points"),
    ({"seeds": [10**400]}, "seeds.0", "less than or equal to"),
    ({"explainers": {"residuals_forest": {"floor": 1e300}}}, "explainers.residuals_forest", "floor"),
    ({"learners": {"learner_forest": {"trees": 10**12}}}, "learners.learner_forest", "trees"),
    ({"learners": {"learner_logistic": {"inverse_regularisation": float("inf")}}}, "inverse_regularisation"),
    # names
    ({"sources": {"x" * 101: source()["sources"]["mine"]}}, "sources"),
    ({"sources": {"mine\n": source()["sources"]["mine"]}}, "sources", "control character"),
    ({"sources": {"../up": source()["sources"]["mine"]}}, "sources"),
    ({"encoders": {"{seed}": {"backbone": "dgcnn"}}}, "encoders"),
    # places
    (source(location="/dev"), "sources.mine", "devices"),
    (source(location="link"), "sources.mine", "devices"),
    (source(location="fifo"), "sources.mine", "is not a folder"),
    (source(location="nowhere"), "sources.mine", "does not exist"),
    (source(location=""), "sources.mine.location"),
    (source(location="a\0b"), "sources.mine.location", "control character"),
    (source(location="~nobody_of_this_name/parts"), "sources.mine", "home folder of an unknown user"),
    ({"data_dir": "/dev"}, "data_dir", "devices"),
    ({"data_dir": ""}, "data_dir"),
    ({"data_dir": "x" * 5000}, "too long"),
    ({"data_dir": "mine.yaml"}, "mine.yaml", "no such folder"),
    ({"downloads": "/dev/null/here"}, "downloads", "devices"),
    ({"downloads": "mine.yaml/here"}, "downloads", "is not a folder"),
    (source(location="loop"), "sources.mine", "loop: is a symbolic link that leads in a circle"),
    (frames(location="loop", optional=True), "real_world.datasets", "leads in a circle"),
    (frames(errors="~nobody_of_this_name/e.csv"), "real_world.datasets", "home folder of an unknown user"),
    # objects
    (source(kind="bop", objects=[1, 2]), "sources.mine", "obj_000002.ply: no such model; check objects in the config"),
    (source(kind="bop", objects=[1, 1]), "sources.mine.objects", "twice"),
    (source(objects=[1]), "sources.mine", "objects: are ids, which the kind mesh_folder has not"),
    (source(kind="bop", files=["*.none"]), "sources.mine", "pattern '*.none': matches no file in"),
    ({"splits": {"objects": "nowhere.csv"}}, "splits.objects", "nowhere.csv: no such file"),
    ({"splits": {"scenes": "splits/objects.csv"}}, "splits.scenes", "column 'dataset' is missing"),
    (frames(split="parts", models="nowhere"), "real_world.datasets.mine", "nowhere: no such folder"),
    (frames(split="other"), "real_world.datasets.mine", "parts: has no other*/<scene>/scene_gt.json"),
    # patterns
    (source(files=["../*.ply"]), "sources.mine", "pattern '../*.ply': leads out of location"),
    (frames(split="../test"), "real_world.datasets", "leads out of location"),
    (source(files=["/etc/*.ply"]), "sources.mine", "/etc/*.ply"),
    (source(files=["."]), "sources.mine", "pattern"),
    (source(files=["a**b"]), "sources.mine", "a**b"),
    (source(files=[]), "sources.mine.files"),
    # addresses
    (source(url="https://a.org/b\nc"), "sources.mine.url", "control character"),
    (source(url="https://a.org/b.zip", sha256="0" * 64 + "\n"), "sources.mine.sha256", "control character"),
]


@pytest.mark.parametrize(("config", "words"), [(config, words) for config, *words in VALUES])
def test_a_value_that_cannot_be(tmp_path, config, words):
    shown = '{"0": [{"obj_id": 3}]}'
    for name, text in {
        "models/obj_000001.ply": "ply",
        "parts/000001/scene_gt.json": "ply",
        "test/1/scene_gt.json": shown,
    }.items():
        (tmp_path / "parts" / name).parent.mkdir(parents=True)
        (tmp_path / "parts" / name).write_text(text)
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "link").symlink_to("/dev")
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({"data_dir": str(tmp_path)} | config))
    refusal(["check-config", "mine.yaml"], tmp_path, *words)


def test_configs_are_laid_over_each_other_as_snakemake_does_it():
    own = {"run": "mine", "seeds": [7], "registrations": {"train": 36}, "sources": {"ycb": False}}
    assert with_defaults() == load()
    assert with_defaults({"run": "first", "seeds": [1]}, own) == with_defaults(own)
    assert with_defaults(own)["registrations"] == load()["registrations"] | {"train": 36}


@pytest.mark.parametrize(
    "text",
    [
        "run: mine\nregistrations: {train: +90, cloud_points: 0x800}\ndata_dir: ~\n",
        '{"run":\n\t"mine"}',
        "\ufeffrun: mine\n",
        "run: mine # café\n",
    ],
)
def test_a_sound_config_says_so(tmp_path, text):
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(AssertionError, match="status 0: run mine: valid"):
        refusal(["check-config", "mine.yaml"], tmp_path)
