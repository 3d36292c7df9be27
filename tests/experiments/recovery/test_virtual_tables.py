import pytest

from gpca.errors import InputError
from gpca.experiments.recovery import virtual_tables
from gpca.experiments.recovery.virtual_tables import as_samples, register_situations
from gpca.pairs.perturbation import CONCEPTS
from tests.failures import LOOP


def test_the_classifier_learns_from_all_causes(situations):
    registered = register_situations(situations, 6, 3, LOOP)
    assert [episode.number for episode in registered["train"]] == list(range(6))
    registrations = as_samples(registered)
    assert registrations.concept.tolist() == list(CONCEPTS) * 3
    assert registrations.split.tolist() == ["train"] * 6 + ["test"] * 3


def test_a_camera_that_sees_too_little_is_a_fault(situations, monkeypatch):
    monkeypatch.setattr(virtual_tables, "register_first", lambda *_: None)
    with pytest.raises(InputError, match=r"40 views .* fewer than 64 points of them; give recovery.camera more pixels"):
        register_situations(situations, 1, 0, LOOP)
