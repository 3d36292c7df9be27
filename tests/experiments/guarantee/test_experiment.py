"""What the config may say of promises, and which explainers they are made for."""

import pytest

from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.errors import InputError

from ...config.configs import changed


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("level", 1.0, "guarantee.level: 1.0 should be less than 1"),
        ("nonconformity", "rank", "guarantee.nonconformity: 'rank' should be "),
        ("explainers", ["oracle"], "guarantee.explainers: no explainer 'oracle'; choose one of chance, "),
        ("explainers", ["chance"], "guarantee.explainers: explainer 'chance' reads neither descriptors nor"),
    ],
)
def test_a_fault_is_one_line_that_names_the_key(key, value, message):
    with pytest.raises(InputError) as caught:
        check(changed(f"guarantee.{key}", value))
    assert str(caught.value).startswith(f"config key {message}")


def test_an_explainer_that_the_diagnosis_leaves_out_has_no_promises():
    config = without_false(changed("diagnosis.explainers.pair_committee", False))
    assert "pair_committee" not in config["guarantee"]["explainers"]
    assert "reenact_committee" in config["guarantee"]["explainers"]
