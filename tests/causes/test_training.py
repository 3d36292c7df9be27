"""What explainers learn from: the training samples of all sources, of none of the families that are tested."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import LabeledSamples, describe_all
from gpca.causes.settings import DescriptorSettings
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.steps.diagnosis import explained
from gpca.steps.learning_curve import describe


class Recorder(ScoringExplainer):
    """An explainer that keeps what it learned from."""

    labels = LABELS
    learned = None

    def fit(self, registrations):
        Recorder.learned = registrations

    def scores(self, registrations):
        return np.full((len(registrations), 4), 0.25)


@pytest.fixture(scope="module")
def files(causes, tmp_path_factory):
    """Causes of a source and of another, whose training samples have families that the first tests and others."""
    folder = tmp_path_factory.mktemp("sources")
    registrations, test = causes.registrations, causes.rows("test")
    train = causes.rows("train")
    cluster = registrations.cluster.copy()
    cluster[train] = np.where(np.arange(len(train)) % 2, registrations.cluster[test[0]], "elsewhere")
    other = replace(causes, registrations=replace(registrations, cluster=cluster, axes=("five", 100)))
    few, paths = DescriptorSettings(starts=1, restarts=1, icp_points=64), {}
    for name, each in (("four", causes), ("five", other)):
        paths[name] = folder / f"causes/{name}.npz", folder / f"descriptors/{name}.npz"
        for path in paths[name]:
            path.parent.mkdir(exist_ok=True)
        each.save(paths[name][0])
        describe_all(each, name, 100, few, ICPSettings())[0].save(paths[name][1])
    samples = describe(other, ICPSettings())
    further = folder / "chunk0.npz"
    samples.subset(np.flatnonzero(np.isin(samples.concept, LABELS))).save(further, ("five", 100))
    return paths, further


@pytest.mark.parametrize("further", [False, True])
def test_samples_of_other_sources_are_learned_from_but_no_family_that_is_tested(causes, files, further):
    paths, chunk = files
    entry = ExplainerEntry("Recorder", Recorder, ("pair",), reads="descriptors", further=further)
    args = (entry, {}, causes, *paths["four"], DescriptorSettings())
    explained(*args)
    own = len(Recorder.learned)
    explained(*args, others=[paths["five"]], further=[chunk])
    learned, tested = Recorder.learned, set(causes.registrations.cluster[causes.rows("test")])
    assert not tested & set(learned.cluster) and "elsewhere" in learned.cluster
    assert own < len(learned) and isinstance(learned, LabeledSamples) == further
    from_file = LabeledSamples.load(chunk).cluster == "elsewhere"
    assert (learned.cluster == "elsewhere").sum() == from_file.sum() * (2 if further else 1)
