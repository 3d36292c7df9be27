"""Predictions in a CSV: written, read, and refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.tracks.submission import Submission, read_head, read_submission


@pytest.fixture
def head(shipped):
    words = {"track": "causes", "version": shipped.version, "method": "My method", "authors": "A. Author"}
    words |= {"link": "https://github.com/author/method", "seconds": "0.02", "hardware": "two cores"}
    return words | {"reads": "pair", "icp_calls": "3"}


@pytest.fixture
def written(shipped, head, tmp_path):
    """The file of a submission that abstains once."""
    method = replace(shipped.methods[1], named=np.where(np.arange(len(shipped.rows)) == 1, -1, 2))
    Submission(head, method).write(path := tmp_path / "mine.csv", shipped)
    return path


def test_a_file_is_read_as_it_was_written(written, head, shipped):
    read = read_submission(written, shipped)
    assert read.head == head
    assert (read.method.name, read.method.title) == ("My method (submitted)", "My method")
    assert (read.method.reads, read.method.icp_calls) == ("pair", 3)
    np.testing.assert_allclose(read.method.scores, shipped.methods[1].scores)
    assert read.method.named.tolist() == [2, -1, *[2] * (len(shipped.rows) - 2)]
    assert read_head(written)[0]["track"] == "causes"


def test_rows_may_come_in_any_order_and_without_what_is_named(written, shipped):
    lines = written.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    columns, *rows = (line.rpartition(",")[0] for line in lines[len(head) :])
    written.write_text("\n".join([*head, columns, *reversed(rows)]) + "\n")
    read = read_submission(written, shipped)
    assert (read.method.named == shipped.methods[1].scores.argmax(axis=1)).all()


def swapped(old, new, count=1):
    return lambda text: text.replace(old, new, count)


def line_of(number, change):
    """Change one of the rows of samples, counted from 0."""

    def changed(text):
        lines = text.splitlines()
        first = next(place for place, line in enumerate(lines) if not line.startswith("#"))
        place = first + 1 + number
        lines[place : place + 1] = change(lines[place])
        return "\n".join(lines) + "\n"

    return changed


FAULTS = {
    "no authors": (swapped("# authors: A. Author\n", ""), "its head lacks 'authors'; add a line '# authors: …', who"),
    "twice": (swapped("# track", "# track: causes\n# track"), "line 2: 'track' stands there twice; keep one"),
    "track": (swapped("track: causes", "track: hard"), "is of the track 'hard', not causes; name the track"),
    "version": (swapped("# version: ", "# version: 0"), "of the samples, and these are of"),
    "link": (swapped("https:", "javascript:"), "'link' is 'javascript://github.com/author/method'; give an address"),
    "seconds": (swapped("0.02", "fast"), "'seconds' is 'fast'; give a number of 0 or more"),
    "negative": (swapped("seconds: 0.02", "seconds: -1"), "'seconds' is '-1'; give a number of 0 or more"),
    "column": (swapped("score_pose", "score_position"), "score_overlap, named; the columns are source, seed"),
    "extra": (swapped(",named", ",names"), "score_overlap, names; the columns are source, seed"),
    "entries": (line_of(0, lambda line: [line + ",1"]), "line 11: has 9 entries, not 8; give one for each column"),
    "unknown": (line_of(0, lambda line: ["five" + line[4:]]), "line 11: source five, seed 100, sample 0 is no test"),
    "again": (line_of(0, lambda line: [line, line]), "sample 0 is no test sample, or stands there"),
    "missing": (line_of(2, lambda line: []), "1 test samples are missing, first source four, seed 100, sample 2"),
    "number": (line_of(0, lambda line: [line.replace(line.split(",")[3], "nan")]), "line 11: 'nan' is not a finite"),
    "label": (line_of(0, lambda line: [line.rpartition(",")[0] + ",gravity"]), "label 'gravity': unknown; choose"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_line_that_says_where_and_what_to_do(fault, written, shipped):
    change, words = FAULTS[fault]
    text = written.read_text()
    changed = change(text)
    assert changed != text
    written.write_text(changed)
    with pytest.raises(InputError) as caught:
        read_submission(written, shipped)
    line = str(caught.value)
    assert words in line and "\n" not in line and line.startswith(str(written))


def test_what_is_no_text_or_names_no_track_is_refused(shipped, tmp_path):
    (path := tmp_path / "mine.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not a text file in UTF-8; write it anew"):
        read_submission(path, shipped)
    path.write_text("# track: clouds\n")
    with pytest.raises(InputError, match="its head names no track; add a line '# track: …', one of causes, hard"):
        read_head(path)
    with pytest.raises(InputError, match="no such file"):
        read_submission(tmp_path / "none.csv", shipped)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("x" * 200_000, "is not a readable CSV file"),
        ("source,seed,sample\n1e300,1e300,1e300\n", "has the columns source, seed, sample; the columns are"),
    ],
)
def test_what_no_table_is_as_long_as_is_one_line(shipped, written, text, fault):
    head = [line for line in written.read_text().splitlines() if line.startswith("#")]
    written.write_text("\n".join([*head, text]))
    with pytest.raises(InputError, match=fault) as caught:
        read_submission(written, shipped)
    assert len(str(caught.value)) < 400
