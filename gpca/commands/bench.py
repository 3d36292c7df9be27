"""Command ``bench``: a method of your own on the fixed samples of a track, as a row among the published ones."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

from gpca.errors import InputError, require_known
from gpca.explainers.registry import CAUSES, explainers
from gpca.io.files import require_outputs
from gpca.plugins import load, named, use
from gpca.process.arguments import COUNT
from gpca.process.processor import cpu_name
from gpca.tracks.leaderboard import as_text_among
from gpca.tracks.published import Method
from gpca.tracks.samples import Samples
from gpca.tracks.submission import Submission
from gpca.tracks.track import TRACKS, Track, track_of
from gpca.tracks.trial import try_method


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the track and the method; ``--settings`` are those of the method."""
    parser.add_argument("track", help=f"one of {', '.join(TRACKS)}")
    parser.add_argument("method", help="a file such as my_method.py, an installed module, or the name of an explainer")
    parser.add_argument("--out", type=Path, help="CSV of its predictions, for gpca score and the leaderboard")
    parser.add_argument("--authors", default="unknown", help="authors, for the head of that file")
    parser.add_argument("--link", default="none", help="link to code or a paper, for that head")
    parser.add_argument("--samples", type=Path, help="folder of the samples (default: the user's cache)")
    parser.add_argument("--data-dir", type=Path, help="folder of data that the repository does not have (track scans)")
    parser.add_argument("--learn-from", help="what it learns from, where there is a choice: scans (default) or objects")
    parser.add_argument("--processes", type=COUNT, help="processes that make samples (default: one per core)")


def run(options: Namespace) -> None:
    """Fit, predict, score and print; what is missing of the samples is made first."""
    track = track_of(options.track)
    if options.out:
        require_outputs([options.out])
    names = _names(options.method, track)
    if options.out and len(names) > 1:
        fault = f"lists {len(names)} methods for this track, and --out holds the predictions of one"
        raise InputError(options.method, fault, "give each a file of its own")
    training = track.training(options.learn_from)
    samples = Samples.of(track, options.samples, options.processes, options.data_dir)
    known = {method.name for method in samples.published.methods}
    mine: dict[str, Method] = {}
    for name in names:
        print(f"{name}: learning and predicting", file=sys.stderr)
        method, seconds = try_method(samples, name, options.settings, training)
        if method.name in known:
            method = replace(method, name=f"{method.name} (here)", title=f"{method.title} (here)")
        mine[method.name] = method
        if options.out:
            head = {"track": track.name, "version": samples.published.version, "method": method.title}
            head |= {"authors": options.authors, "link": options.link, "seconds": f"{seconds:.4g}"}
            head |= {"hardware": cpu_name(), "reads": method.reads, "icp_calls": str(method.icp_calls)}
            Submission(head, method).write(options.out, samples.published)
    print(as_text_among(samples.published, mine))


def _names(method: str, track: Track) -> list[str]:
    """Return the names of the methods that a file or a module lists for a track, and make them known.

    Raises:
        InputError: it cannot be imported, or lists none; no explainer has that name.
    """
    if not method.endswith(".py") and method in (known := explainers(track.kind)):
        return [method]
    if not method.endswith(".py") and "." not in method and not _is_module(method):
        require_known("explainer", method, known)
    variable = "CAUSE_EXPLAINERS" if track.kind == CAUSES else "EXPLAINERS"
    entries = getattr(load(method), variable, None)
    if not entries:
        fault = f"lists no {variable}, whom the track {track.name} asks"
        raise InputError(method, fault, f"give it {variable} = {{'my_method': ExplainerEntry(…)}}")
    use([*named(), method])
    return list(entries)


def _is_module(name: str) -> bool:
    from importlib.util import find_spec

    return find_spec(name) is not None
