import pytest

from gpca.errors import InputError
from gpca.experiments.reenactment.experiment import EXPERIMENT

CONFIG = {"seeds": [3, 4, 5], "sources": {"a": {}, "b": {}}, "oracles": {"sources": ["b"], "seeds": 2}}


def test_oracles_are_asked_about_the_named_sources_and_the_first_seeds():
    names = EXPERIMENT.names(CONFIG, {})
    assert (names["oracle_source"], names["oracle_seed"]) == (["b"], [3, 4])


def test_a_source_that_there_is_not_is_refused():
    config = CONFIG | {"oracles": {"sources": ["c"], "seeds": 1}}
    with pytest.raises(InputError, match=r"oracles\.sources"):
        EXPERIMENT.check(config, lambda kind: set())
