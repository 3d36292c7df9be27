"""What is shipped of a track: collected from a run, written, and read again."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.dataset import Causes, labels_of
from gpca.commands.tracks import LARGEST_BYTES
from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.errors import InputError
from gpca.frames.source import REAL_WORLD
from gpca.tracks import published as module
from gpca.tracks.published import FOLDER, Published, Rows
from gpca.tracks.shipping import collect
from gpca.tracks.track import TRACKS, track_of

from ..config.configs import load
from .conftest import SEED, SOURCE


def test_the_truth_and_what_methods_predict_are_kept_and_the_version_is_of_the_samples(shipped, causes):
    tested = causes.subset(causes.rows("test"))
    [(source, seed, rows)] = shipped.rows.parts()
    assert (source, seed, rows.tolist()) == (SOURCE, SEED, list(range(len(tested))))
    truth = shipped.truth_of(rows)
    assert (labels_of(truth.truth) == labels_of(tested.truth)).all()
    np.testing.assert_array_equal(truth.truth_again.error, tested.truth_again.error)
    assert (shipped.rows.object == tested.registrations.object_name).all()
    chance, rule = shipped.methods
    assert (chance.name, chance.reads, chance.icp_calls) == ("chance", "nothing", 0)
    assert rule.icp_calls > 0
    assert set(chance.labels_named(TRACKS["causes"].labels)) == {"pose"}
    assert rule.scores.shape == (len(shipped.rows), 4)
    assert replace(shipped, methods=()).version == shipped.version
    assert replace(shipped, hashes=dict.fromkeys(shipped.hashes, "0")).version != shipped.version


def test_the_file_is_read_as_it_was_written_and_the_same_contents_are_the_same_bytes(shipped, tmp_path):
    for name in ("first.npz", "second.npz"):
        shipped.save(tmp_path / name)
    read = Published.load(TRACKS["causes"], tmp_path / "first.npz")
    for name in Rows.array_fields():
        np.testing.assert_array_equal(getattr(read.rows, name), getattr(shipped.rows, name))
    assert (read.version, read.limits, read.hashes) == (shipped.version, shipped.limits, shipped.hashes)
    assert [method.title for method in read.methods] == [method.title for method in shipped.methods]
    assert (tmp_path / "first.npz").read_bytes() == (tmp_path / "second.npz").read_bytes()


def test_a_file_that_is_missing_or_says_what_no_track_asks_is_refused(shipped, tmp_path, monkeypatch):
    with pytest.raises(InputError, match="no such file, in which the published rows are; restore it, or make it"):
        Published.load(TRACKS["causes"], tmp_path / "causes.npz")
    wrong = replace(shipped.methods[0], named=np.full(len(shipped.rows), 4))
    replace(shipped, methods=(wrong,)).save(tmp_path / "causes.npz")
    with pytest.raises(InputError, match="names labels that the track does not have"):
        Published.load(TRACKS["causes"], tmp_path / "causes.npz")
    with pytest.raises(InputError, match="track 'clouds': unknown; choose one of causes, hard, frames, scans"):
        track_of("clouds")
    monkeypatch.setattr(module, "DATA", tmp_path / "data")  # of a package without its repository
    with pytest.raises(InputError, match=r"track hard: needs the data and the published .* 'pip install -e'"):
        Published.load(TRACKS["hard"])


def test_predictions_of_other_samples_are_refused(run, config, tmp_path):
    causes = Causes.load(run / f"causes/{SOURCE}/seed{SEED}.npz")
    causes.subset(np.arange(len(causes) - 1)).save(tmp_path / f"causes/{SOURCE}/seed{SEED}.npz")
    (tmp_path / "diagnoses").symlink_to(run / "diagnoses")
    with pytest.raises(InputError, match="predictions of other test samples than its own"):
        collect(TRACKS["causes"], tmp_path, config)


def test_the_parts_of_the_tracks_are_those_of_the_default_config():
    config = without_false(load())
    check(config)
    sources, seeds = list(config["sources"]), config["seeds"]
    assert TRACKS["causes"].parts(config) == [(source, seed) for seed in seeds for source in sources]
    hard = config["controls"]["seeds"]
    assert TRACKS["hard"].parts(config) == [(source, seed) for seed in seeds[:hard] for source in ("linemod", "ycb")]
    assert TRACKS["frames"].parts(config) == [(REAL_WORLD, seeds[0])]
    assert TRACKS["scans"].parts(config) == [(name, seeds[0]) for name in config["scans"]["datasets"]]
    assert set(TRACKS["scans"].everywhere) <= set(config["scans"]["datasets"])


def test_shipped_predictions_are_small_whole_and_of_the_config_of_their_track():
    files = sorted(FOLDER.glob("*.npz"))
    assert {path.stem for path in files} <= set(TRACKS)
    assert sum(path.stat().st_size for path in files) <= LARGEST_BYTES
    for path in files:
        track = TRACKS[path.stem]
        config = track.config()
        published = Published.load(track, path)
        parts, wanted = [(source, seed) for source, seed, _ in published.rows.parts()], track.parts(config)
        known = [part for part in parts if part in wanted]  # the others are of sources that the next run has no more
        assert known == [part for part in wanted if part in parts or not track.may_lack(part[0])]
        assert set(published.hashes) >= {track.file(*part) for part in parts}
