"""Registrations of six objects, and an experiment whose encoder and explainers cost nothing."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.classifier.scores import Attribution
from gpca.explainers.interface import ExplainerEntry
from gpca.objects.surface import instance_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.control_samples import ControlSettings
from gpca.steps.controls import ControlRun
from gpca.uncertainty.settings import UncertaintySettings

NAMES = ("brick", "cone", "capsule", "ball", "mug_1_1_1", "mug_1_1_2")  # two views of one mug


class Nearest:
    """Names the concept of the training sample with the nearest embedding."""

    def fit(self, registrations):
        self.h, self.concept = registrations.embedding, registrations.concept

    def explain(self, registrations):
        apart = np.abs(registrations.embedding[:, None] - self.h[None]).sum(axis=2)
        named = self.concept[apart.argmin(axis=1)]
        scores = np.array([[name == each for each in CONCEPTS] for name in named], float)
        return Attribution.of_scores(CONCEPTS, scores * 0.8 + 0.1, seconds=0.0)


class Head(Nearest):
    """Knows what the head says; labels teach it nothing."""

    trained_with_encoder = True

    def fit(self, registrations):
        pass

    def explain(self, registrations):
        return Attribution.of_scores(CONCEPTS, registrations.attached["head_logits"], seconds=0.0)


@pytest.fixture(scope="session")
def six(registrations):
    """The registrations of the other tests, as if they showed six objects."""
    number = np.arange(len(registrations)) // len(CONCEPTS) % len(NAMES)
    names = np.array(NAMES)[number]
    return replace(registrations, object_name=names, cluster=np.array([instance_of(name) for name in names.tolist()]))


def seen(registrations, source="tiny"):
    """What a perfect encoder would make of them."""
    h = np.array([[name == each for each in CONCEPTS] for name in registrations.concept], np.float32)
    return h, h


def attached(registrations):
    h, logits = seen(registrations)
    return {"embedding": h, "head_logits": logits}


def rival(make, reads, **more):
    """An explainer that is made without arguments."""
    return ExplainerEntry("", make, (), reads, **more)


def experiment(registrations, *controls, embeddings=(), rivals=None):
    settings = ControlSettings(controls=controls, draw_points=(32, 64))
    return ControlRun(
        source="tiny",
        seed=100,
        settings=settings,
        backbone="dgcnn",
        uncertainty=UncertaintySettings(starts=13, icp_points=32),
        rivals=rivals or {"nearest": rival(Nearest, "embeddings"), "head": rival(Head, "embeddings")},
        embed=seen,
        embeddings={"paper": attached(registrations), **dict(embeddings)},
    )
