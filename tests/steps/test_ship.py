"""The step ``ship``: the same model in the package, and a card whose numbers are those of the run."""

import hashlib
import json
import shutil
from dataclasses import replace

import pytest

from gpca.commands import ship
from gpca.commands.ship import licenses_of
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.process.code_files import ROOT
from tests.steps.by_words import main

from .spoiling import content, removed, written

SHIP = ["ship", "--model", "real/model.pt", "--out", "shipped.pt", "--card", "shipped.md"]
MESH = "/data/bop/lm/models/obj_000001.ply"
FRAME = "/data/bop/lmo/test/000002/depth/000003.png"
SETTINGS = {
    "causes": {
        "severities": {"noise": [0.01, 0.0834]}, "limits": {"failed": 0.0312}, "points": [128, 1024], "moved": "model",
    },
    "model": {"false_alarms": 0.05, "causes": {"moved": "observed"}},
}  # fmt: skip


def record(path, inputs, settings):
    said = {
        "inputs_sha256": dict.fromkeys(inputs, "0" * 64), "settings": settings, "seed": 7,
        "code": {"version": "0.1.0", "commit": "c0ffee", "dirty": False}, "settings_sha256": "5" * 64,
    }  # fmt: skip
    path.with_name(f"{path.name}.provenance.json").write_text(json.dumps(said))


@pytest.fixture(scope="module")
def run(model, objects, tmp_path_factory):
    """The files of a run that ``ship`` reads, of a model that says that it learned real objects."""
    folder = tmp_path_factory.mktemp("run") / "real"
    (folder / "objects").mkdir(parents=True)
    replace(model, stand_in=False, title="Frames", learned_from=("Tiny things",)).save(folder / "model.pt")
    learnt = [f"results/full/{name}/seed0.npz" for name in ("model_causes/tiny", "registrations/frames")]
    record(folder / "model.pt", learnt, SETTINGS)
    for name, inputs, settings in (
        ("tiny", [MESH], {"entry": {"title": "Tiny things", "stand_in": False, "url": "https://x/lm_models.zip"}}),
        ("frames", [MESH, FRAME], {"datasets": {"lmo": {"location": "bop/lmo"}}}),
    ):
        objects.save(folder / f"objects/{name}.npz", name)
        record(folder / f"objects/{name}.npz", inputs, settings)
    return folder


@pytest.fixture
def folder(run, tmp_path, monkeypatch):
    """A copy of the run to spoil, below the working folder."""
    shutil.copytree(run, tmp_path / "real")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_is_shipped_explains_as_the_runs_model_does(folder, registrations):
    assert main(SHIP) == 0
    source, target = registrations.cloud(0), registrations.target(0)
    said = [Explainer(Model.load(path)).explain(source, target).as_dict() for path in ("real/model.pt", "shipped.pt")]
    for explanation in said:
        del explanation["seconds"]
    assert said[0]["learned_from"] == "the diagnosis learned from Tiny things; GP-CA as in the paper from Frames"
    assert said[0] == said[1]


def test_the_card_has_the_numbers_of_the_run_and_the_same_run_gives_the_same_bytes(folder, model):
    assert main(SHIP) == 0
    first = content(folder)
    text = first["shipped.md"].decode()
    for words in (
        hashlib.sha256(first["shipped.pt"]).hexdigest(), f"{len(first['shipped.pt'])} bytes", "commit `c0ffee`",
        f"trained on {model.diagnoser.classifier.samples} registrations", "| Tiny things | 3 | diagnosis |",
        "| Frames | 3 | GP-CA |",
        "| LINEMOD in BOP | CC BY 4.0 | seen: the card of a copy of the dataset | Tiny things; Frames |",
        "| LINEMOD-Occlusion in BOP | CC BY-SA 4.0 | seen: ",
        "above 0.0312 of", "noise 0.01 to 0.0834", '- `moved: "observed"`',
        f"{model.diagnoser.at_default.threshold:.3f}",
        f"| {model.diagnoser.held_out['balanced_accuracy']:.3f} | ", "calibrated at 1, 2, 3, 5, 10",
        *(f"| {100 * at.tolerance:g} % | {at.held_out['auroc_failed']:.3f} (" for at in model.diagnoser.levels),
    ):  # fmt: skip
        assert words in text, words
    assert "the true one with a probability of 0.9, calibrated on single registrations" in " ".join(text.split())
    assert "YCB" not in text
    assert "/data/" not in text
    assert main(SHIP) == 0
    assert content(folder) == first


def test_a_model_is_shipped_without_its_objects_by_their_records(folder):
    for path in folder.glob("real/objects/*.npz"):
        path.unlink()
    assert main(SHIP) == 0
    assert "| Tiny things | – | diagnosis |" in (folder / "shipped.md").read_text()


SUMS = (ROOT / "data/SHA256SUMS").read_text().splitlines()


def test_every_file_of_the_repositorys_data_that_a_run_reads_has_a_license():
    names = [line.split("  ")[1] for line in SUMS]
    read = [name for name in names if "/" in name and not name.endswith(".md")]
    assert len(read) > 100
    for name in read:
        assert licenses_of(f"data/{name}", ROOT), name


def provenance(name, inputs=(MESH,), **settings):
    return lambda folder: record(folder / name, inputs, settings)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (removed("real/model.pt"), "real/model.pt: no such model"),
        (removed("real/model.pt.provenance.json"), "model.pt.provenance.json: no such file"),
        (
            written("real/model.pt.provenance.json", "{}"),
            "model.pt: has incomplete records of its run (KeyError('inputs_sha256'))",
        ),
        (provenance("real/model.pt"), "lists nothing that a model learns from"),
        (
            provenance("real/objects/tiny.npz", entry={"title": "Tiny", "stand_in": True}),
            "tiny.npz: contains objects that the package drew; ship a model of real objects",
        ),
        (
            provenance("real/objects/tiny.npz", ["/mine/secret.ply"], entry={"title": "Tiny"}),
            "tiny.npz: was made from 'secret.ply', which is from a dataset without a known license; add the dataset",
        ),
    ],
)
def test_a_run_that_cannot_be_shipped_is_refused_in_one_line(folder, spoil, words, capsys):
    spoil(folder)
    before = content(folder)
    assert main(SHIP) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("gpca ship: ")
    assert words in line
    assert content(folder) == before


def test_a_model_that_the_package_should_not_carry_is_refused(folder, model, monkeypatch, capsys):
    before = content(folder)
    monkeypatch.setattr(ship, "LARGEST_BYTES", 1000)
    assert main(SHIP) == 2
    assert "MB, more than the 0.001 MB allowed in the package" in capsys.readouterr().err
    assert content(folder) == before
    replace(model, stand_in=True).save("real/model.pt")
    assert main(SHIP) == 2
    assert "was trained on objects that the package drew" in capsys.readouterr().err
    assert not (folder / "shipped.pt").exists()
