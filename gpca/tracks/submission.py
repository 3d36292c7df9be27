"""A submission: a CSV of predictions with a head of comments about the method, and a row per test sample.

::

    # track: causes
    # version: 0123456789ab
    # method: My method
    # authors: A. Author, B. Author
    # link: https://github.com/author/my-method
    # seconds: 0.02
    # hardware: two cores of a laptop
    source,seed,sample,score_nominal,score_noise,score_pose,score_overlap
"""

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.files import is_title, require_file, whole_file
from gpca.numerals import LARGEST_NUMBER, decimal, whole
from gpca.tracks.published import NO_CALLS, NOTHING_NAMED, Method, Published
from gpca.tracks.track import TRACKS

HEAD = {  # required entry -> its description
    "track": f"one of {', '.join(TRACKS)}",
    "version": "of the samples, as gpca bench and gpca.load print it",
    "method": "its name",
    "authors": "who made it",
    "link": "to code or a paper, or none",
    "seconds": "for each registration, on one core where that is known",
    "hardware": "what it ran on",
}
OPTIONAL = {"reads": "what it sees of a registration", "icp_calls": "runs of ICP beyond the one that it explains"}
KEYS = ("source", "seed", "sample")
NO_LINK = "none"
LINK_REMEDY = f"give an address that begins with https://, or {NO_LINK}"
NAMED = "named"  # optional column: the predicted label, empty for none; by default that of the largest score
LARGEST_BYTES = 10**7
MOST_LINES = 10**5
MOST_FAULTS = 20  # in the list


@dataclass(frozen=True)
class Submission:
    """Predictions for the test samples of a track, or of some of its sources."""

    head: Mapping[str, str]  # by the keys of `HEAD` and `OPTIONAL`
    method: Method

    def write(self, path: Path, published: Published) -> None:
        """Write the CSV."""
        labels, rows = published.track.labels, published.rows
        with whole_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
            file.writelines(f"# {key}: {self.head[key]}\n" for key in (*HEAD, *OPTIONAL) if self.head.get(key))
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([*KEYS, *(f"score_{label}" for label in labels), NAMED])
            named_N = self.method.labels_named(labels)
            for row in np.flatnonzero(np.isfinite(self.method.scores).all(axis=1)):
                keys = (rows.source[row], rows.seed[row], rows.sample[row])
                writer.writerow([*keys, *(f"{value:.6f}" for value in self.method.scores[row]), named_N[row]])


Fault = Callable[[str, str, str], None]  # notes where, what, and the remedy


def read_submission(path: Path, published: Published) -> tuple[Submission | None, list[str]]:
    """Return a submission to a track, or None, and its faults, a line each, no more than `MOST_FAULTS`."""
    faults: list[str] = []

    def fault(where: str, what: str, remedy: str) -> None:
        faults.append(f"{path}{', ' if where else ''}{where}: {what}; {remedy}")

    require_file(path, "no such file", "give a CSV file of predictions", LARGEST_BYTES)
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        fault("", "is not a text file in UTF-8", "write it anew")
        return None, faults
    if len(lines) > MOST_LINES:
        fault(
            "", f"has {len(lines)} lines, more than {MOST_LINES}", "give a row for each test sample, and few comments"
        )
        return None, faults
    length = next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
    head = _read_head(lines[:length], published, fault)
    if head.get("track") not in (None, published.track.name):  # its rows say nothing
        return None, faults
    try:
        predictions = _read_rows(lines[length:], length, published, fault)
    except csv.Error as damage:
        fault("", f"is not a readable CSV file ({damage})", "write it anew")
    if len(faults) > MOST_FAULTS:
        faults = [*faults[:MOST_FAULTS], f"{path}: {len(faults) - MOST_FAULTS} faults more"]
    if faults or predictions is None:
        return None, faults
    calls = int(head["icp_calls"]) if head.get("icp_calls") else NO_CALLS
    name = f"{head['method']} (submitted)"  # differs from the published ones, and is the same on all tracks
    return Submission(head, Method(name, head["method"], head.get("reads", ""), calls, *predictions)), faults


def _read_head(lines: list[str], published: Published, fault: Fault) -> dict[str, str]:
    head: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        key, colon, value = (part.strip() for part in line[1:].partition(":"))
        if not colon or key not in {**HEAD, **OPTIONAL}:
            continue  # any other comment
        if key in head:
            fault(f"line {number}", f"'{key}' stands there twice", "keep one of them")
        head[key] = value
    for key, words in HEAD.items():
        if not is_title(head.get(key, "")):
            what = "has a long or broken" if head.get(key) else "lacks"
            fault("", f"its head {what} '{key}'", f"add a line '# {key}: …', {words}")
    track, version = published.track.name, published.version
    if head.get("track", track) != track:
        fault("", f"is of the track '{head['track']}', not {track}", "name the track that it is of")
    elif head.get("version", version) != version:
        other = f"is of version '{head['version']}' of the samples, and these are of {version}"
        fault("", other, "predict these: gpca.load makes them")
    if not is_link(link := head.get("link", NO_LINK)):
        fault("", f"'link' is '{link[:40]}'", LINK_REMEDY)
    for key, read in (("seconds", decimal), ("icp_calls", whole)):
        text = head.get(key, "")
        try:
            if text and read(text) < 0:
                raise ValueError
        except ValueError:
            fault("", f"'{key}' is '{text[:40]}'", "give a number of 0 or more")
    return head


def _read_rows(
    lines: list[str], before: int, published: Published, fault: Fault
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return scores and named labels; None if columns are missing, so that no row can be read."""
    track, rows = published.track, published.rows
    scores = [f"score_{label}" for label in track.labels]
    table = csv.reader(lines)
    columns = next(table, [])
    wanted = [*KEYS, *scores]
    for name in (name for name in wanted if columns.count(name) != 1):
        what = f"column '{name}' is {'missing' if name not in columns else 'there twice'}"
        fault(f"line {before + 1}", what, f"the columns are {', '.join(wanted)} and, if you like, {NAMED}")
    for name in (name for name in columns if name not in (*wanted, NAMED)):
        fault(f"line {before + 1}", f"column '{name}' is unknown", "remove it")
    if any(columns.count(name) != 1 for name in wanted):
        return None
    keys = zip(*(map(str, column.tolist()) for column in (rows.source, rows.seed, rows.sample)), strict=True)
    row_of_key = {key: row for row, key in enumerate(keys)}
    scores_N_C, named_N = np.full((len(rows), len(scores)), np.nan), np.full(len(rows), NOTHING_NAMED)
    seen: dict[int, int] = {}
    for number, cells in enumerate(table, before + 2):
        if not cells:
            continue
        line = f"line {number}"
        if len(cells) != len(columns):
            fault(line, f"has {len(cells)} entries, not {len(columns)}", "give one for each column")
            continue
        entry = dict(zip(columns, cells, strict=True))
        row = row_of_key.get(tuple(entry[name].strip() for name in KEYS))
        if row is None:
            words = f"source {entry['source']}, seed {entry['seed']}, sample {entry['sample']}"
            fault(line, f"{words} is no test sample", "give those of gpca.load with split='test'")
            continue
        if row in seen:
            fault(line, f"is of the same sample as line {seen[row]}", "keep one of them")
        seen[row] = number
        for column, name in enumerate(scores):
            try:
                scores_N_C[row, column] = value = decimal(entry[name].strip())
                if abs(value) > LARGEST_NUMBER:
                    raise ValueError
            except ValueError:
                words = f"'{name}' is '{entry[name][:40]}', no finite number up to {LARGEST_NUMBER:.0e}"
                fault(line, words, "give a number")
        label = entry.get(NAMED, "").strip()
        if NAMED not in entry:
            named_N[row] = scores_N_C[row].argmax()
        elif label in track.labels:
            named_N[row] = track.labels.index(label)
        elif label:
            fault(line, f"'{label[:40]}' is no label", f"choose one of {', '.join(track.labels)}")
    sources = {str(rows.source[row]) for row in seen}
    needed = {key: row for key, row in row_of_key.items() if key[0] in sources or not track.may_lack(key[0])}
    if missing := [key for key, row in needed.items() if row not in seen]:
        source, seed, sample = missing[0]
        words = f"{len(missing)} of {len(needed)} test samples are missing, first source {source}, seed {seed}"
        fault("", f"{words}, sample {sample}", "give every sample once")
    return scores_N_C, named_N


def is_link(text: str) -> bool:
    return text == NO_LINK or text.startswith(("https://", "http://"))


def track_in_head(path: Path) -> str:
    """Return the track that the head of a submission names."""
    require_file(path, "no such file", "give a CSV file of predictions", LARGEST_BYTES)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for line in takewhile(lambda line: line.startswith("#"), file):
            key, _, value = (part.strip() for part in line[1:].partition(":"))
            if key == "track" and value in TRACKS:
                return value
    raise InputError(path, "its head names no track", f"add a line '# track: …', one of {', '.join(TRACKS)}")
