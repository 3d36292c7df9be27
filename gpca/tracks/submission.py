"""A submission: a CSV of predictions, a row per test sample, with a head of comments (docs/adding.md)."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np

from gpca.errors import InputError, refusing, require_known
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


def read_head(path: Path) -> tuple[dict[str, str], list[str]]:
    """Return the entries of a submission's head, with a track among them, and all lines."""
    require_file(path, "no such file", "give a CSV file of predictions", LARGEST_BYTES)
    with refusing(path, "is not a text file in UTF-8", "write it anew"):
        lines = path.read_text("utf-8-sig").splitlines()
    head: dict[str, str] = {}
    for number, line in enumerate(takewhile(lambda line: line.startswith("#"), lines), 1):
        key, colon, value = (part.strip() for part in line[1:].partition(":"))
        if not colon or key not in {**HEAD, **OPTIONAL}:
            continue  # any other comment
        if key in head:
            raise InputError(f"{path}, line {number}", f"'{key}' stands there twice", "keep one of them")
        head[key] = value
    if head.get("track") not in TRACKS:
        raise InputError(path, "its head names no track", f"add a line '# track: …', one of {', '.join(TRACKS)}")
    return head, lines


def read_submission(path: Path, published: Published) -> Submission:
    """Return a submission to a track; InputError for its first fault."""
    head, lines = read_head(path)
    track, version = published.track.name, published.version
    if head["track"] != track:
        raise InputError(path, f"is of the track '{head['track']}', not {track}", "name the track that it is of")
    for key, words in HEAD.items():
        if not is_title(head.get(key, "")):
            what = "has a long or broken" if head.get(key) else "lacks"
            raise InputError(path, f"its head {what} '{key}'", f"add a line '# {key}: …', {words}")
    if head["version"] != version:
        other = f"is of version '{head['version']}' of the samples, and these are of {version}"
        raise InputError(path, other, "predict these: gpca.load makes them")
    if not is_link(head["link"]):
        raise InputError(path, f"'link' is '{head['link'][:40]}'", LINK_REMEDY)
    for key, read in (("seconds", decimal), ("icp_calls", whole)):
        with refusing(path, f"'{key}' is '{head.get(key, '')[:40]}'", "give a number of 0 or more"):
            if head.get(key) and read(head[key]) < 0:
                raise ValueError
    with refusing(path, "is not a readable CSV file ({})", "write it anew"):
        predictions = _read_rows(path, lines, published)
    calls = int(head["icp_calls"]) if head.get("icp_calls") else NO_CALLS
    name = f"{head['method']} (submitted)"  # differs from the published ones, and is the same on all tracks
    return Submission(head, Method(name, head["method"], head.get("reads", ""), calls, *predictions))


def _read_rows(path: Path, lines: list[str], published: Published) -> tuple[np.ndarray, np.ndarray]:
    track, rows = published.track, published.rows
    scores = [f"score_{label}" for label in track.labels]
    first = next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
    table = csv.reader(lines[first:])
    columns, wanted = next(table, []), [*KEYS, *scores]
    if sorted(columns) not in (sorted(wanted), sorted([*wanted, NAMED])):
        fault = f"has the columns {', '.join(columns)[:100]}"
        remedy = f"the columns are {', '.join(wanted)} and, if you like, {NAMED}"
        raise InputError(f"{path}, line {first + 1}", fault, remedy)
    keys = zip(*(map(str, column.tolist()) for column in (rows.source, rows.seed, rows.sample)), strict=True)
    row_of_key, sources = {key: row for row, key in enumerate(keys)}, set[str]()
    scores_N_C, named_N = np.full((len(rows), len(scores)), np.nan), np.full(len(rows), NOTHING_NAMED)
    for number, cells in enumerate(table, first + 2):
        line = f"{path}, line {number}"
        if not cells:
            continue
        if len(cells) != len(columns):
            raise InputError(line, f"has {len(cells)} entries, not {len(columns)}", "give one for each column")
        entry = {name: cell.strip() for name, cell in zip(columns, cells, strict=True)}
        row = row_of_key.pop(tuple(entry[name] for name in KEYS), None)
        if row is None:
            words = f"source {entry['source']}, seed {entry['seed']}, sample {entry['sample']}"
            fault = f"{words[:100]} is no test sample, or stands there twice"
            raise InputError(line, fault, "give those of gpca.load with split='test', once each")
        sources.add(entry["source"])
        with refusing(line, "{}", "give finite numbers"):
            scores_N_C[row] = [decimal(entry[name]) for name in scores]
        if abs(scores_N_C[row]).max() > LARGEST_NUMBER:
            raise InputError(line, "a score is out of bounds", f"give numbers up to {LARGEST_NUMBER:.0e}")
        if NAMED not in entry:
            named_N[row] = scores_N_C[row].argmax()
        elif entry[NAMED]:
            require_known(f"{line}: label", entry[NAMED][:40], track.labels)
            named_N[row] = track.labels.index(entry[NAMED])
    if missing := [key for key in row_of_key if key[0] in sources or not track.may_lack(key[0])]:
        source, seed, sample = missing[0]
        words = f"{len(missing)} test samples are missing, first source {source}, seed {seed}, sample {sample}"
        raise InputError(path, words, "give every sample once")
    return scores_N_C, named_N


def is_link(text: str) -> bool:
    return text == NO_LINK or text.startswith(("https://", "http://"))
