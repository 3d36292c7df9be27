"""Step ``follow_gradients``: gradients of GP-CA's log odds in the points (saliency) and along concepts (TCAV).

A saliency map is the gradient of a score in the input (Simonyan et al. 2014), here in the points that the encoder sees.
Zheng et al. (2019) regard deleting a point as moving it to the center: its saliency is r² ∂/∂r of the score, with r the
distance from the center.

TCAV (Kim et al. 2018): a concept activation vector is the normal of a linear probe that separates examples of a concept
from random samples, in the embedding that GP-CA reads. The score of a concept for a class is the share of the class's
test samples whose log odds of the class grow along the vector. It is significant where a two-sided t-test, with
Bonferroni's correction, separates it from the scores of as many vectors between random samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.settings import Bounds, Distinct, OpenShare

if TYPE_CHECKING:
    import torch

    from gpca.classifier.gpc import GPC

GRADIENT, CENTER, LEAST, RANDOM = "gradient", "to_centre", "least_gradient", "random"  # orders of deletion
RANDOM_ORDERS = 4  # that are averaged
DELETION_COLUMNS = ("sample", "concept", "named", "order", "deleted", "before", "after", "changed")
ONE_OBJECT = "one object"  # a concept that should not matter: samples of the most frequent object
FEWEST = 4  # examples of a concept


@dataclass(frozen=True)
class GradientSettings:
    """The samples, deletions and concept vectors of the gradients.

    Attributes:
        samples: test samples of each source and seed whose points are deleted, balanced; all where there are fewer.
        deleted: shares of a cloud's points.
        vectors: number of concept vectors of each concept, and of random ones.
        level: TCAV's level of significance, over all its tests of a source and seed.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 30
    deleted: Distinct[OpenShare] = (0.05, 0.1, 0.25)
    vectors: Annotated[int, Bounds(minimum=2, maximum=1000)] = 20
    level: OpenShare = 0.05


def run(job: Job) -> None:
    from gpca.classifier.gpc import GPC
    from gpca.encoders.training import load_model

    settings, encoding = GradientSettings(**job.section("gradients")), EncoderSettings(**job.section("encoder"))
    files = ("registrations", "encoders", "embeddings", "deletions", "tcav")
    for seed, *paths in progress(list(job.per_seed(*files)), f"gradients of {job.source}"):
        inputs, outputs, axes = paths[:3], paths[3:], (job.source, seed)
        with record_provenance(outputs, inputs, job.settings, seed=seed):
            plain = Registrations.load(inputs[0], axes)
            registrations = replace(plain, attached=read_embedding(inputs[2], plain))
            train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
            gpc = GPC(CONCEPTS, GPCSettings(**job.section("gpc")), *axes)
            gpc.fit(train.embedding, train.concept)
            encoder = load_model(inputs[1], encoding, axes=axes).encoder
            write_csv(outputs[0], deletions(encoder, gpc, registrations, *axes, encoding, settings))
            write_csv(outputs[1], tcav(gpc, train, test, settings, *axes))


def chosen_rows(registrations: Registrations, count: int) -> np.ndarray:
    """Rows of the first test samples of each concept, `count` in all or as many as there are."""
    test = registrations.rows("test")
    by_concept = [test[registrations.concept[test] == concept][: count // len(CONCEPTS)] for concept in CONCEPTS]
    return np.sort(np.concatenate(by_concept))


def log_odds(logits_N_C: torch.Tensor, number: int) -> torch.Tensor:
    """Log odds (N,) of the class of that number against all others."""
    from gpca.portable import log_sum_exp

    others = [c for c in range(logits_N_C.shape[1]) if c != number]
    return logits_N_C[:, number] - log_sum_exp(logits_N_C[:, others])


def point_gradient(encoder: torch.nn.Module, gpc: GPC, cloud_1_N_3: torch.Tensor, number: int) -> np.ndarray:
    """Gradient (N, 3) of a class's log odds in the points, per diameter."""
    import torch

    points = cloud_1_N_3.clone().requires_grad_()
    (gradient_1_N_3,) = torch.autograd.grad(log_odds(gpc.mean_logits(encoder(points)), number).sum(), points)
    return gradient_1_N_3[0].numpy().astype(float)


def saliencies(points_N_3: np.ndarray, gradient_N_3: np.ndarray) -> dict[str, np.ndarray]:
    """Saliency (N,) of each point: length of its gradient, and the fall of the score when it moves to the median."""
    outwards_N_3 = points_N_3 - np.median(points_N_3, axis=0)
    radius_N = np.linalg.norm(outwards_N_3, axis=1)
    falling_N = np.sum(gradient_N_3 * outwards_N_3, axis=1) * radius_N  # r² ∂/∂r, as ∂/∂r is along the unit vector
    return {GRADIENT: np.linalg.norm(gradient_N_3, axis=1), CENTER: falling_N}


def orders(salient: Mapping[str, np.ndarray], *axes: object) -> dict[str, list[np.ndarray]]:
    """Orders (N,) in which points are deleted, by name; several random ones."""
    by_length = np.argsort(-salient[GRADIENT], kind="stable")
    return {
        GRADIENT: [by_length],
        CENTER: [np.argsort(-salient[CENTER], kind="stable")],
        LEAST: [by_length[::-1]],
        RANDOM: [generator(*axes, "deleted", again).permutation(len(by_length)) for again in range(RANDOM_ORDERS)],
    }


def deletions(
    encoder: torch.nn.Module,
    gpc: GPC,
    registrations: Registrations,
    source: str,
    seed: int,
    encoding: EncoderSettings,
    settings: GradientSettings,
) -> Frame:
    """Delete points of test samples in every order, and explain what is left with GP-CA.

    `DELETION_COLUMNS` by sample, order and share: the score of the concept that is named on the whole draw, before and
    after, and the share of orders after which another one is named.
    """
    import pandas as pd
    import torch

    from gpca.encoders.training import draw_points

    records: list[tuple] = []
    for row in chosen_rows(registrations, settings.samples):
        sample = int(registrations.sample[row])
        cloud_1_N_3: Any = draw_points(registrations, np.array([row]), encoding.draw_points, source, seed, "saliency")
        points_N_3 = cloud_1_N_3[0].numpy().astype(float)
        (before_C,) = _scores(encoder, gpc, cloud_1_N_3)
        named = int(before_C.argmax())
        salient = saliencies(points_N_3, point_gradient(encoder, gpc, cloud_1_N_3, named))
        ways = orders(salient, source, seed, sample)
        for share in settings.deleted:
            kept = max(1, round((1 - share) * len(points_N_3)))
            rows_W_K = np.array([np.sort(way[len(way) - kept :]) for repeats in ways.values() for way in repeats])
            after_W_C = _scores(encoder, gpc, cloud_1_N_3[0][torch.from_numpy(rows_W_K)])
            for order, repeats in ways.items():
                after_R_C, after_W_C = np.split(after_W_C, [len(repeats)])
                changed = np.mean(after_R_C.argmax(axis=1) != named)
                scores = (before_C[named], after_R_C[:, named].mean(), changed)
                records.append((sample, registrations.concept[row], gpc.classes[named], order, share, *scores))
    return pd.DataFrame(records, columns=list(DELETION_COLUMNS))


def _scores(encoder: torch.nn.Module, gpc: GPC, clouds_B_N_3: torch.Tensor) -> np.ndarray:
    import torch

    with torch.no_grad():
        return gpc.attribute(encoder(clouds_B_N_3).numpy())[0]


def concept_examples(train: Registrations, concepts: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Whether each training sample (N,) shows a concept: each perturbation, and the most frequent object."""
    examples = {concept: train.concept == concept for concept in concepts}
    names, counts = np.unique(train.object_name, return_counts=True)
    if len(names) > 1:
        examples[ONE_OBJECT] = train.object_name == names[counts.argmax()]
    return {name: shown_N for name, shown_N in examples.items() if shown_N.sum() >= FEWEST}


def tcav(gpc: GPC, train: Registrations, test: Registrations, settings: GradientSettings, *axes: object) -> Frame:
    """Test every concept for every class by a GPC that was fitted to the training samples.

    Rows of ``tested``, ``concept`` (the class), ``score``, ``chance`` (means over the vectors), ``p`` of the test,
    ``significant`` (0 or 1), ``probe`` (balanced accuracy of the concept's probes on held-out samples).
    """
    import pandas as pd
    import torch

    h_N_d = train.embedding.astype(float)
    mean_d, deviation_d = h_N_d.mean(axis=0), np.maximum(h_N_d.std(axis=0), 1e-9)
    scaled_N_d = (h_N_d - mean_d) / deviation_d
    gradients = {}  # (n, d) of a class's log odds in the embeddings of its test samples
    for number, concept in enumerate(gpc.classes):
        if (is_class_N := test.concept == concept).any():
            h_n_d = torch.from_numpy(test.embedding[is_class_N].astype(float)).requires_grad_()
            odds_n = log_odds(gpc.mean_logits(h_n_d), number)
            gradients[concept] = torch.autograd.grad(odds_n.sum(), h_n_d)[0].numpy() * deviation_d
    examples = concept_examples(train, gpc.classes)
    rows = []
    for tested, shown_N in examples.items():
        size = max(2, min(int(shown_N.sum()), int((~shown_N).sum())) // 2)
        probes = [_vector(scaled_N_d, shown_N, size, *axes, tested, v) for v in range(settings.vectors)]
        drawn = [_vector(scaled_N_d, None, size, *axes, tested, v) for v in range(settings.vectors)]
        for concept, gradient_N_d in gradients.items():
            score_V, chance_V = (
                [float(np.mean(gradient_N_d @ vector_d > 0)) for vector_d, _ in vectors] for vectors in (probes, drawn)
            )
            p = two_sided_p(score_V, chance_V)
            significant = int(p < settings.level / (len(examples) * len(gradients)))
            probe = np.mean([accuracy for _, accuracy in probes])
            rows.append((tested, concept, np.mean(score_V), np.mean(chance_V), p, significant, probe))
    return pd.DataFrame(rows, columns=["tested", "concept", "score", "chance", "p", "significant", "probe"])


def two_sided_p(score_V: list[float], chance_V: list[float]) -> float:
    """Probability of so large a difference of means by chance (Welch); 0 or 1 where neither varies."""
    from scipy.stats import t as student_t

    difference = abs(np.mean(score_V) - np.mean(chance_V))
    errors_2 = np.array([np.var(values_V, ddof=1) / len(values_V) for values_V in (score_V, chance_V)])
    if not errors_2.any():
        return float(difference == 0)
    freedom = errors_2.sum() ** 2 / np.sum(errors_2**2 / (np.array([len(score_V), len(chance_V)]) - 1))
    return float(2 * student_t.sf(difference / np.sqrt(errors_2.sum()), freedom))


def _vector(scaled_N_d: np.ndarray, shown_N: np.ndarray | None, size: int, *axes: object) -> tuple[np.ndarray, float]:
    """Unit vector (d,) towards a concept, or between random samples, and its probe's balanced accuracy.

    The probe is fitted to `size` examples and as many other samples.
    """
    from sklearn.linear_model import LogisticRegression

    random = generator(*axes, "random vector" if shown_N is None else "concept vector")
    order_N = random.permutation(len(scaled_N_d))
    if shown_N is None:
        shown_N = np.isin(np.arange(len(order_N)), order_N[: len(order_N) // 2])
        order_N = random.permutation(len(order_N))
    parts = [order_N[shown_N[order_N]], order_N[~shown_N[order_N]]]
    learned = np.concatenate([part[:size] for part in parts])
    probe = LogisticRegression(max_iter=1000).fit(scaled_N_d[learned], shown_N[learned])
    others = [part[size:] for part in parts if len(part) > size]
    accuracy = np.mean([np.mean(probe.predict(scaled_N_d[part]) == shown_N[part]) for part in others]) if others else 1
    return probe.coef_[0] / max(float(np.linalg.norm(probe.coef_[0])), 1e-12), float(accuracy)
