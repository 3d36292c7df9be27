"""Commands for the tracks: ``bench``, ``score``, ``leaderboard`` and ``ship-predictions``."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from gpca.errors import InputError, require_known
from gpca.io.files import PAGE, require_apart, require_outputs, require_page, write_text
from gpca.jobs.arguments import COUNT
from gpca.tracks import leaderboard
from gpca.tracks.published import FOLDER, Published
from gpca.tracks.submission import LINK_REMEDY, is_link, read_submission
from gpca.tracks.track import CAUSES_TRACK, DEFAULT, TRACKS, Track, track_of

REPAIR = "repair"  # a track of poses, not of predictions
LARGEST_BYTES = 10**7  # of the published predictions of all tracks, which are kept in git


def add_bench_arguments(parser: ArgumentParser) -> None:
    """Declare the track and the method; ``--settings`` are the method's."""
    add = parser.add_argument
    add("track", help=f"one of {', '.join(TRACKS)}, or repair")
    add("method", help="a file such as my_method.py, an installed module, or the name of an explainer")
    add("--out", type=Path, help="CSV of its predictions, for gpca score and the leaderboard")
    add("--authors", default="unknown", help="authors, for the head of that file")
    add("--link", default="none", help="link to code or a paper, for that head")
    add("--samples", type=Path, help="folder of the samples (default: the user's cache)")
    add("--data-dir", type=Path, help="folder of data that the repository does not have (track scans)")
    add("--processes", type=COUNT, help="processes that make samples (default: one per core)")


def run_bench(options: Namespace) -> None:
    """Fit a method, predict and score on the samples of a track; missing samples are made first."""
    from gpca.process.processor import cpu_name
    from gpca.tracks.published import Method
    from gpca.tracks.samples import TrackSamples, cache_of
    from gpca.tracks.submission import Submission
    from gpca.tracks.trial import try_method

    if options.track == REPAIR:
        from gpca.tracks.repair import own_function, repair_table

        for name in ("out", "settings", "data_dir"):
            if getattr(options, name):
                option = f"--{name.replace('_', '-')}"
                raise InputError(option, f"is no option of the track {REPAIR}", "leave it out")
        function = own_function(options.method)
        samples = TrackSamples.of(TRACKS[CAUSES_TRACK], options.samples, options.processes)
        print(leaderboard.as_text(repair_table(samples, function, Path(options.method).stem)))
        return
    track = track_of(options.track)
    if not is_link(options.link):
        raise InputError("--link", f"is '{options.link[:40]}'", LINK_REMEDY)
    module = options.method.replace(".", "/")  # if it is below the working directory
    require_apart(options, ["out"], [module, f"{module}.py", cache_of(track)])
    names = _method_names(options.method, track)
    if options.out and len(names) > 1:
        fault = f"lists {len(names)} methods for this track, and --out holds the predictions of one"
        raise InputError(options.method, fault, "give each a file of its own")
    samples = TrackSamples.of(track, options.samples, options.processes, options.data_dir)
    published_names = {method.name for method in samples.published.methods}
    methods: dict[str, Method] = {}
    for name in names:
        print(f"{name}: learning and predicting", file=sys.stderr)
        method, seconds = try_method(samples, name, options.settings)
        if method.name in published_names:
            method = replace(method, name=f"{method.name} (here)", title=f"{method.title} (here)")
        methods[method.name] = method
        if options.out:
            head = {"track": track.name, "version": samples.published.version, "method": method.title}
            head |= {"authors": options.authors, "link": options.link, "seconds": f"{seconds:.4g}"}
            head |= {"hardware": cpu_name(), "reads": method.reads, "icp_calls": str(method.icp_calls)}
            Submission(head, method).write(options.out, samples.published)
    print(leaderboard.as_text_among(samples.published, methods))


def _method_names(method: str, track: Track) -> list[str]:
    """Return the names of the methods for a track that a file or a module lists, and register it as a plugin."""
    from importlib.util import find_spec

    from gpca.explainers.registry import CAUSES, explainers
    from gpca.process.plugins import load, named, use

    if not method.endswith(".py"):
        if method in (explainer_names := explainers(track.kind)):
            return [method]
        if "." not in method and find_spec(method) is None:
            require_known("explainer", method, explainer_names)
    variable = "CAUSE_EXPLAINERS" if track.kind == CAUSES else "EXPLAINERS"
    entries = getattr(load(method), variable, None)
    if not entries or not isinstance(entries, Mapping):
        fault = f"lists no {variable}, whom the track {track.name} asks"
        raise InputError(method, fault, f"give it {variable} = {{'my_method': ExplainerEntry(…)}}")
    use([*named(), method])
    return list(entries)


def add_score_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("track", help=f"one of {', '.join(TRACKS)}")
    add("predictions", type=Path, nargs="?", help="CSV with a head of comments (default: the published rows alone)")
    add("--published", type=Path, help="folder of the published rows (default: those of the leaderboard)")


def run_score(options: Namespace) -> None:
    """Check and score predictions, or recompute the published rows."""
    track = track_of(options.track)
    published = Published.load(track, options.published and options.published / f"{track.name}.npz")
    if options.predictions is None:
        print(leaderboard.as_text_among(published, {}))
        return
    submission = read_submission(options.predictions, published)
    print(leaderboard.as_text_among(published, {submission.method.name: submission.method}))


def add_leaderboard_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    folder = leaderboard.FOLDER
    add("--submissions", type=Path, default=folder, help="folder of CSV files (default: results/leaderboard)")
    add("--out", type=Path, help="the page (default: index.html in that folder)")
    add("--check", action="store_true", help="only check the files")


def run_leaderboard(options: Namespace) -> int:
    """Check all submissions and write the page; faults are lines on stderr, with status 2."""
    from gpca.page.page import render

    page = options.out = options.out or options.submissions / f"index{PAGE}"
    if not options.check:
        require_apart(options, ["out"])
        require_page(page)
    submissions, faults = leaderboard.read_submissions(options.submissions)
    if faults:
        print(*faults, sep="\n", file=sys.stderr)
        return 2
    counts = ", ".join(f"{len(entries)} of the track {track}" for track, entries in submissions.items()) or "none"
    print(f"submissions: {counts}")
    if not options.check:
        write_text(page, render("leaderboard.html.jinja", boards=leaderboard.boards(submissions)))
        print(page)
    return 0


def add_ship_predictions_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    folder = Path("results") / DEFAULT
    add("--run", dest="folder", type=Path, default=folder, help=f"folder of the run (default: {folder})")
    add("--config", help="name of the run's config (default: that of the track)")
    add("--out", type=Path, default=FOLDER, help="folder to write them to")
    default_tracks = [name for name, track in TRACKS.items() if track.run == DEFAULT]
    others = "; ".join(f"{name} needs the run {track.run}" for name, track in TRACKS.items() if track.run != DEFAULT)
    words = f"tracks to extract (default: those of the default run; {others})"
    add("--tracks", nargs="+", default=default_tracks, help=words)


def run_ship_predictions(options: Namespace) -> None:
    """Write the published predictions of each track from a finished run; the same run gives the same bytes."""
    from gpca.tracks.shipping import collect

    total = 0
    paths = {name: options.out / f"{track_of(name).name}.npz" for name in options.tracks}
    require_outputs(paths.values(), [options.folder])
    for name, path in paths.items():
        track = replace(track_of(name), run=options.config or track_of(name).run)
        published = collect(track, options.folder, track.config())
        published.save(path)
        total += path.stat().st_size
        print(f"{path}: {len(published.methods)} methods, {len(published.rows)} samples, version {published.version}")
    if total > LARGEST_BYTES:
        raise InputError(options.out, f"has {total / 1e6:.1f} MB, more than {LARGEST_BYTES / 1e6:g}", "leave rows out")
