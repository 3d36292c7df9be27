import dataclasses
import importlib
import sys

import numpy as np
import pytest

import baselines
from gpca.causes.settings import DescriptorSettings
from gpca.errors import InputError
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import REENACTED, WORDS, ExplainerEntry, icp_calls, in_words
from gpca.explainers.registry import CAUSES, explainer_entry, explainers
from gpca.explainers.registry import CONCEPTS as CONCEPTS_KIND
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.designs import DESIGNS

QUICK = {"learning_rate": 0.05, "iterations": 30, "inducing": 12, "draws": 100}


@pytest.fixture(scope="module")
def embedded(registrations):
    """Registrations whose embedding tells the concept, as a trained encoder's does."""
    centers = 3 * np.random.default_rng(0).normal(size=(3, 8))
    concept_S = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
    h = centers[concept_S] + np.random.default_rng(1).normal(size=(len(concept_S), 8))
    return dataclasses.replace(registrations, attached={"embedding": h})


@pytest.fixture
def own_baseline(tmp_path, monkeypatch):
    """A file of the user's in a folder of baselines."""
    (tmp_path / "always_noise.py").write_text(
        "from gpca.explainers.gpca import GPCA\nfrom gpca.explainers.interface import ExplainerEntry\n"
        "EXPLAINERS = {'always_noise': ExplainerEntry('Always noise', GPCA, ('source',))}\n"
    )
    (tmp_path / "helper_without_explainers.py").write_text("")
    monkeypatch.setattr(baselines, "__path__", [*baselines.__path__, str(tmp_path)])
    importlib.invalidate_caches()
    yield "always_noise"
    for name in ("always_noise", "helper_without_explainers"):
        sys.modules.pop(f"baselines.{name}", None)


def test_every_entry_can_be_headed_and_fed():
    for name in ("gpca", "gpca_paper"):
        assert (explainer_entry(name).reads, explainer_entry(name).oracle) == ("embeddings", False)
    for name, entry in explainers().items():
        assert entry.title, name
        assert entry.reads in ("registrations", "embeddings", REENACTED) or entry.design in DESIGNS, name
        assert ("oracle" in entry.title) == entry.oracle, name


@pytest.mark.parametrize("kind", [CONCEPTS_KIND, CAUSES])
def test_every_entry_says_what_it_sees(kind):
    for name, entry in explainers(kind).items():
        assert entry.sight, name
        assert "source" in entry.sees or entry.reads != "embeddings", name
        assert ("truth" in entry.sees) == entry.oracle, name
        if kind == CONCEPTS_KIND:  # what runs ICP again reads the outcomes, and reads them for that alone
            assert bool({"runs", "remedies"} & set(entry.sees)) == bool(entry.design or entry.reads == REENACTED), name
    assert [name for name, entry in explainers(kind).items() if not entry.sees] == ["chance", "most_frequent"]


@pytest.mark.parametrize("sees", ["pair", ("pairs",), ["pair"], None])
def test_what_an_explainer_sees_is_a_tuple_of_known_parts(sees):
    with pytest.raises(InputError, match=r"explainer 'Mine': sees .*; give a tuple of source, pair, .*, or \(\)"):
        ExplainerEntry("Mine", GPCA, sees)


def test_a_file_dropped_into_baselines_is_found_and_an_unknown_explainer_refused_with_the_known_ones(own_baseline):
    assert explainer_entry(own_baseline).title == "Always noise"
    assert {"gpca", "gpca_paper", own_baseline} <= set(explainers())
    with pytest.raises(InputError, match=r"explainer 'shapley': unknown; choose one of .*gpca_paper, gpca"):
        explainer_entry("shapley")


def test_gpca_names_the_concept_and_does_not_look_at_what_it_is_to_explain(embedded):
    explainer = explainer_entry("gpca").make("tiny", 0, **QUICK)
    explainer.fit(embedded.subset(embedded.rows("train")))
    test = embedded.subset(embedded.rows("test"))
    attribution = explainer.explain(test)
    assert attribution.concepts == CONCEPTS
    assert np.mean(attribution.predicted_N == test.concept) > 0.9
    assert not attribution.abstained_N.any()
    assert attribution.icp_calls_N.tolist() == [0] * len(test)
    assert (attribution.seconds_N > 0).all()
    shuffled = dataclasses.replace(embedded, concept=np.roll(embedded.concept, 1))
    expected = explainer.explain(embedded)
    for other in (shuffled, embedded.without_labels()):
        attribution = explainer.explain(other)
        for name in ("scores_N_C", "variances_N_C", "bald_N"):
            assert np.array_equal(getattr(attribution, name), getattr(expected, name))


SETTINGS = DescriptorSettings(starts=3, restarts=8)


def test_words_stand_in_one_order_and_nothing_is_a_word():
    assert in_words(("motion", "pair")) == in_words(("pair", "motion")) == "pair + motion"
    assert in_words(()) == "nothing"
    assert all(in_words((part,)) == words for part, words in WORDS.items())


@pytest.mark.parametrize(
    ("sees", "calls"),
    [
        ((), 0),
        (("pair", "motion"), 0),
        (("pair", "runs"), 12),
        (("remedies",), 44),
        (("pair", "quick_remedies"), 12),
        (("pair", "motion", "runs", "remedies"), 56),
    ],
)
def test_calls_are_those_beyond_the_observed_run(sees, calls):
    assert icp_calls(sees, 13, SETTINGS) == calls
