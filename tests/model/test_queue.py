"""The file of queued registrations, which grows."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from gpca.__main__ import main
from gpca.active_learning.labeling import Queue, add_to_queue, is_queue
from gpca.errors import InputError


@pytest.fixture(scope="module")
def explained(explainer, pair):
    return explainer.explain(*pair)


def test_a_queue_grows_by_one_and_keeps_what_it_had(explainer, explained, tmp_path):
    path, scene = tmp_path / "queued.npz", explained.scene
    h_1_d = explainer.embed(scene.aligned)
    assert [
        add_to_queue(path, scene.aligned, scene.target, n * h_1_d, f"scan{n}.ply to box.stl") for n in (1, 2, 3)
    ] == [1, 2, 3]
    queue = Queue.load(path)
    assert is_queue(path)
    assert queue.object_name.tolist() == [f"scan{n}.ply to box.stl" for n in (1, 2, 3)]
    np.testing.assert_allclose(queue.h, np.arange(1, 4)[:, None] * h_1_d, rtol=1e-5)
    for row in range(3):
        np.testing.assert_allclose(queue.cloud(row), scene.aligned, atol=1e-6)
        np.testing.assert_allclose(queue.target(row), scene.target, atol=1e-6)


def test_what_is_no_queue_or_of_another_model_is_refused(explained, registrations, tmp_path):
    registrations.save(tmp_path / "registrations.npz")
    assert not is_queue(tmp_path / "registrations.npz")
    assert not is_queue(tmp_path / "lost.npz")
    clouds = explained.scene.aligned, explained.scene.target
    with pytest.raises(InputError, match=r"registrations.npz: is not a queue; name another file with --queue"):
        add_to_queue(tmp_path / "registrations.npz", *clouds, np.zeros((1, 4)), "a to b")
    add_to_queue(tmp_path / "queued.npz", *clouds, np.zeros((1, 4)), "a to b")
    with pytest.raises(InputError, match=r"queued.npz: is a queue of another model"):
        add_to_queue(tmp_path / "queued.npz", *clouds, np.zeros((1, 5)), "a to b")


def test_two_that_queue_at_once_lose_nothing(explained, tmp_path):
    clouds = explained.scene.aligned, explained.scene.target

    def add(n):
        return add_to_queue(tmp_path / "queued.npz", *clouds, np.zeros((1, 4)), f"scan{n}.ply to box.stl")

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(add, range(12))) == list(range(1, 13))
    assert len(set(Queue.load(tmp_path / "queued.npz").object_name)) == 12


def test_a_queue_without_rows_is_refused(explained, tmp_path):
    path, clouds = tmp_path / "queued.npz", (explained.scene.aligned, explained.scene.target)
    add_to_queue(path, *clouds, np.zeros((1, 4)), "a to b")
    np.savez(path, **Queue.load(path).subset(np.arange(0)).arrays)
    with pytest.raises(InputError, match="has no samples"):
        Queue.load(path)


@pytest.mark.parametrize(
    ("queue", "answers", "line"),
    [
        ("short", "good", "short.npz: is damaged, or not an npz archive; make it again"),
        ("good", "utf16", "utf16.txt: is not text in UTF-8"),
        ("good", "long", "'pppppppppppppppppppppppppppppppppppppppp' is not a valid concept name"),
    ],
)
def test_label_refuses_what_is_half_or_no_text(
    explainer, explained, tmp_path, monkeypatch, capsys, queue, answers, line
):
    monkeypatch.chdir(tmp_path)
    clouds = explained.scene.aligned, explained.scene.target
    add_to_queue("good.npz", *clouds, explainer.embed(clouds[0]), "$\\frac{a$ \udcff to b")
    (tmp_path / "short.npz").write_bytes((tmp_path / "good.npz").read_bytes()[:3000])
    (tmp_path / "utf16.txt").write_text("pose\n", encoding="utf-16")
    (tmp_path / "long.txt").write_text("p" * 10**6)
    explainer.model.save("model.pt")
    words = ["label", f"{queue}.npz", "--answers", f"{answers}.txt", "--labels", "labels.csv", "--model", "model.pt"]
    (tmp_path / "good.txt").write_text("pose\n")
    assert main(words) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and line in said[0] and len(said[0]) < 300
