"""TrackSamples: hashed by what they hold, made where they are missing, refused where they differ; and as objects."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

import gpca
from gpca.causes.dataset import Causes, labels_of
from gpca.config.check import check, with_success
from gpca.config.layers import without_false
from gpca.errors import InputError
from gpca.frames.source import REAL_WORLD
from gpca.steps.control_samples import HARD
from gpca.tracks import samples as module
from gpca.tracks.loading import NO_LABEL
from gpca.tracks.samples import TrackSamples, recipe_of, sha256_of_arrays
from gpca.tracks.track import TRACKS

from ..config.configs import load
from .conftest import SEED, SOURCE

FILE = f"causes/{SOURCE}/seed{SEED}.npz"


def test_the_hash_is_of_the_arrays_and_not_of_how_they_are_packed(tmp_path):
    arrays = {"a": np.arange(6.0), "b": np.array(["x"])}
    np.savez(tmp_path / "plain.npz", **arrays)
    np.savez_compressed(tmp_path / "packed.npz", **dict(reversed(arrays.items())))
    np.savez(tmp_path / "other.npz", **(arrays | {"a": np.arange(6.0).reshape(2, 3)}))
    plain, packed, other = (sha256_of_arrays(tmp_path / f"{name}.npz") for name in ("plain", "packed", "other"))
    assert plain == packed != other
    (tmp_path / "other.npz").write_bytes(b"PK")
    with pytest.raises(InputError, match="is not a readable npz archive; remove it; it is made anew"):
        sha256_of_arrays(tmp_path / "other.npz")


def test_samples_that_are_not_the_published_ones_are_refused(published, run, causes, tmp_path):
    samples = TrackSamples(TRACKS["causes"], published, run)
    assert samples.files([FILE]) == [run / FILE]
    named = replace(causes.registrations, axes=(SOURCE, SEED), fitness=causes.registrations.fitness / 2)
    replace(causes, registrations=named).save(tmp_path / FILE)
    with pytest.raises(InputError, match=r"differs from what the published rows were made with .* remove it"):
        TrackSamples(TRACKS["causes"], published, tmp_path).files([FILE])


def test_a_cache_is_cleared_of_what_it_made_and_of_nothing_else(published, run, config, tmp_path, monkeypatch):
    cache = tmp_path / "cache"
    (tmp_path / "elsewhere").mkdir()
    cache.symlink_to("elsewhere")
    monkeypatch.setattr(module, "cache_of", lambda _track: cache)
    monkeypatch.setattr(TrackSamples, "config", config)
    mine = [cache / name for name in ("notes.txt", "causes/mine.npz", "thesis/a.npz", "thesis/a.npz.provenance.json")]
    old = [cache / name for name in (FILE, f"{FILE}.provenance.json", f"causes/{SOURCE}/seed{SEED}.csv")]
    for path in (*mine, *old, cache / f"causes/{SOURCE}/seed{SEED}.csv.provenance.json"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("{}")
    np.savez(old[0], a=np.arange(3))
    made = []
    monkeypatch.setattr(module, "make", lambda files, *_: made.extend(files) or shutil.copy(run / FILE, old[0]))
    assert TrackSamples(TRACKS["causes"], published, cache).files([FILE]) == [old[0]]
    assert made == [FILE] and all(path.is_file() for path in mine) and not any(path.exists() for path in old[1:])


@pytest.fixture(scope="module")
def default():
    """The default config, as the samples are made by it."""
    whole = load()
    check(whole)
    return with_success(without_false(whole))


def test_every_input_of_a_recipe_is_data_or_has_a_recipe(default):
    open_files = [track.file(*part) for track in TRACKS.values() for part in track.parts(default)[:1]]
    open_files += [f"{name}/ycb/seed0.npz" for name in ("descriptors", "reenactments", "cause_embeddings")]
    open_files += [f"control_embeddings/{HARD}/ycb/seed0.npz", f"reenactments/{REAL_WORLD}/seed0.npz"]
    made = set()
    while open_files:
        if (file := open_files.pop()) not in made:
            recipe = recipe_of(file, default)
            assert file in recipe.outputs.values()
            made |= set(recipe.outputs.values())
            open_files += [name for name in recipe.inputs.values() if not name.startswith("/")]
    assert {f"objects/{REAL_WORLD}.npz", "objects/ycb.npz", "timings/ycb/causes/seed0.csv"} <= made
    with pytest.raises(InputError, match="is not a file of samples"):
        recipe_of("tables/ycb/seed0.npz", default)


def test_what_is_missing_is_made_once_and_after_what_it_is_made_from(default, tmp_path, monkeypatch):
    made = []

    def run(recipe, folder):
        assert all(name.startswith("/") or (folder / name).is_file() for name in recipe.inputs.values())
        made.append(recipe.step.rpartition(":")[2])
        for name in recipe.outputs.values():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).touch()

    monkeypatch.setattr(module, "_run", run)
    files = ["reenactments/ycb/seed0.npz", "descriptors/ycb/seed0.npz", "causes/ycb/seed0.npz"]
    module.make(files, tmp_path, default, processes=1)
    assert made[:2] == ["objects", "causes"] and sorted(made[2:]) == ["describe", "reenact"]
    module.make(files, tmp_path, default, processes=1)
    assert len(made) == 4


def test_a_step_that_fails_ends_in_its_own_line(default, tmp_path):
    damaged = tmp_path / "objects/ycb.npz"
    damaged.parent.mkdir()
    damaged.write_bytes(b"PK")
    with pytest.raises(InputError, match=r"step gpca\.steps\.causes:causes: .*ycb\.npz: is not a readable npz archive"):
        module.make(["causes/ycb/seed0.npz"], tmp_path, default, processes=1)


def test_samples_are_arrays_a_frame_and_a_torch_dataset_of_the_split_that_is_asked_for(published, run, causes):
    data = gpca.load("causes", source=SOURCE, split="test", seed=SEED, samples=run)
    tested = causes.subset(causes.rows("test"))
    assert len(data) == len(tested) == 8 and published.version in repr(data)
    np.testing.assert_array_equal(data.sources[0], tested.registrations.cloud(0))
    assert (data.label == labels_of(tested.truth)).all()
    assert data.arrays()["phi"].shape == (8, 3)
    frame = data.frame()
    assert len(frame) == 8 and {"label", "fitness", "phi_pose", "points", "severity_noise"} <= set(frame.columns)
    source_N_3, target_N_3, number = data.torch(64)[0]
    assert source_N_3.shape == target_N_3.shape == (64, 3)
    expected = data.labels.index(data.label[0]) if data.label[0] in data.labels else NO_LABEL
    assert int(number) == expected
    assert len(gpca.load("causes", seed=SEED, samples=run)) == len(causes) == len(Causes.load(run / FILE))


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"source": "cups"}, "source 'cups': unknown; choose one of four"),
        ({"seed": 3}, "seed 3: has no samples of the track causes; choose one of 100"),
        ({"seed": SEED, "split": "validation"}, "split 'validation': unknown; choose one of train, test"),
        ({"track": "clouds"}, "track 'clouds': unknown; choose one of causes, hard, frames"),
    ],
)
def test_samples_that_there_are_not_are_refused(asked, words, published, run):
    with pytest.raises(InputError, match=words):
        gpca.load(**{"samples": run} | asked)
