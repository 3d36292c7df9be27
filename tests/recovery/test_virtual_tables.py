from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.virtual_tables import register_situations

from .conftest import LOOP


def test_the_classifier_learns_from_all_causes(situations):
    registrations = register_situations(situations, 6, 3, LOOP)
    assert registrations.concept.tolist() == list(CONCEPTS) * 3
    assert registrations.split.tolist() == ["train"] * 6 + ["test"] * 3
