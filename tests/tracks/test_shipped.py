"""What the repository ships of the tracks: few bytes, whole, and of the config that each names."""

from gpca.commands.ship_predictions import LARGEST_BYTES
from gpca.config.check import check
from gpca.config.leave_out import without_false
from gpca.tracks.published import FOLDER, Published
from gpca.tracks.track import TRACKS

from ..config.configs import load


def test_shipped_predictions_are_small_whole_and_of_the_config_of_their_track():
    files = sorted(FOLDER.glob("*.npz"))
    assert {path.stem for path in files} <= set(TRACKS)
    assert sum(path.stat().st_size for path in files) <= LARGEST_BYTES
    for path in files:
        track = TRACKS[path.stem]
        config = without_false(load(*(layer.stem for layer in track.layers)))
        check(config)
        published = Published.load(track, path)
        parts = [(source, seed) for source, seed, _ in published.rows.parts()]
        assert parts == [part for part in track.parts(config) if part in parts or not track.may_lack(part[0])]
        assert set(published.hashes) >= {track.file(*part) for part in parts}
