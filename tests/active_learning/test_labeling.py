import csv

import numpy as np
import pytest

from gpca.active_learning.labeling import LabelFile, Session, require_name
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError

NAMES = ("noise", "pose", "overlap")
SETTINGS = GPCSettings(learning_rate=0.2, iterations=30, inducing=12, draws=100)
BLOB = np.arange(60) % 3
H = 4 * np.random.default_rng(0).normal(size=(3, 8))[BLOB] + np.random.default_rng(1).normal(size=(60, 8))
KEYS = [("train", n) for n in range(60)]
START = {KEYS[row]: NAMES[BLOB[row]] for row in range(18) if BLOB[row] < 2}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "deep/labels.csv"


def session(path, **changed):
    return Session(H, KEYS, START, LabelFile(path, dict.fromkeys(KEYS)), SETTINGS, **changed)


def rows(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_an_answer_is_on_the_disk_at_once_and_the_earlier_ones_stay(path):
    labels = LabelFile(path, dict.fromkeys(KEYS))
    labels.add(KEYS[20], "overlap")
    assert rows(path) == [{"sample": "20", "split": "train", "concept": "overlap"}]
    LabelFile(path, dict.fromkeys(KEYS)).add(KEYS[21], "")
    assert [row["concept"] for row in rows(path)] == ["overlap", ""]
    assert LabelFile(path, dict.fromkeys(KEYS)).labels == {KEYS[20]: "overlap", KEYS[21]: ""}


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("3,train,pose\n3,train,noise\n", r"labels.csv, line 3: 'noise' contradicts the earlier 'pose'; remove one"),
        ("77,train,pose\n", r"line 2: no sample '77' of split 'train'"),
        ("3,test,pose\n", r"line 2: no sample '3' of split 'test'"),
        ("-3,train,pose\n", r"line 2: no sample '-3'"),
        ("٣,train,pose\n", r"line 2: no sample '٣'"),
        ("3,train,two words\n", r"line 2: 'two words' is not a valid concept name"),
        ("3,tra", r"line 2: has 2 entries, not 3; correct or remove the line"),
        ("3,tra,pose\n", r"line 2: no sample '3' of split 'tra'"),
        (f"3,train,{'p' * 10**4}\n", r"line 2: 'p{40}' is not a valid concept name; use at most 40"),
        (f"3,train,{'p' * 10**6}\n", r"is not a readable CSV file \(field larger"),
        ("3,train,pose,1\n", r"line 2: has 4 entries, not 3"),
        ('3,train,"po\nse"\n', r"line 2: 'po.*se' is not a valid concept name"),
    ],
)
def test_a_damaged_file_is_named_with_its_line(path, lines, message):
    path.parent.mkdir()
    path.write_text("sample,split,concept\n" + lines)
    with pytest.raises(InputError, match=message):
        LabelFile(path, dict.fromkeys(KEYS))


@pytest.mark.parametrize("name", ["", "Pose", "two words", "ünsharp", "1st", "a,b", "/quit"])
def test_a_name_that_cannot_head_a_column_is_refused(name):
    with pytest.raises(InputError, match="name"):
        require_name(name)


def test_a_new_concept_is_asked_about_first_and_known_after_a_few_answers(path):
    asked = session(path)
    assert asked.gpc.classes == ("noise", "pose")
    first = asked.ask(4)
    assert np.mean([BLOB[question.row] == 2 for question in first]) >= 0.5
    for question in first:
        asked.labels.add(KEYS[question.row], NAMES[BLOB[question.row]])
    assert asked.retrain() == 4
    assert asked.retrain() == 0
    assert asked.gpc.classes == NAMES
    for question in asked.ask(4):
        asked.labels.add(KEYS[question.row], NAMES[BLOB[question.row]])
    asked.retrain()
    predicted = np.array(asked.gpc.classes)[asked.gpc.attribute(H)[0].argmax(axis=1)]
    assert np.mean(predicted == np.array(NAMES)[BLOB]) > 0.95


def test_no_sample_is_asked_about_twice_and_none_of_the_test_split(path):
    keys = [("test" if n % 2 else "train", n) for n in range(60)]
    start = {key: NAMES[BLOB[row]] for row, key in enumerate(keys[:18]) if BLOB[row] < 2}
    asked = Session(H, keys, start, LabelFile(path, dict.fromkeys(keys)), SETTINGS)
    seen = []
    while questions := asked.ask(7):
        seen += [keys[question.row] for question in questions]
        for question in questions:
            asked.labels.add(keys[question.row], "")
    assert len(seen) == len(set(seen))
    assert set(seen) == {key for key in keys if key[0] == "train"} - set(start)


def test_an_interrupted_session_continues_with_what_it_knew(path):
    whole = session(path)
    for question in whole.ask(6):
        whole.labels.add(KEYS[question.row], NAMES[BLOB[question.row]])
    whole.retrain()
    again = session(path)
    assert again.gpc.classes == whole.gpc.classes
    assert np.abs(again.gpc.attribute(H)[0] - whole.gpc.attribute(H)[0]).max() < 0.01
