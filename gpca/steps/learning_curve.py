"""Steps ``learning_samples`` and ``learn_from_more``: more labeled samples, and learners of more and more of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.causes.dataset import LABELS, Causes, labeled, labels_of
from gpca.causes.descriptors import QUICK, LabeledSamples, describe_plainly, joined_without, observed_pair
from gpca.causes.drawing import apportion, draw_further
from gpca.causes.judged import CEILING, Judged, ceiling_of, judged_by, measure
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import BORDERLINE, GEOMETRY
from gpca.classifier.scores import Attribution
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Count, Distinct, read_settings
from gpca.steps.diagnosis import DESCRIBED, training_rows, with_what_it_reads

FEWEST = 20  # training samples of a learner
TREES = 300
LEARNERS = ("trees", "gpca")
MEASURED = ("balanced_accuracy", "regret", "tied_accuracy", "dominant_accuracy", "auroc_failed")
CURVE_COLUMNS = ("learner", "samples", "order", *MEASURED)


@dataclass(frozen=True)
class CurveSettings:
    """The training samples, and the learners of them."""

    seeds: Count = 1
    further: Annotated[int, Bounds(minimum=12)] = 90  # labeled samples of each source besides those of the causes
    chunk: Annotated[int, Bounds(minimum=12)] = 600  # of them that a job draws, at most
    sizes: Distinct[Annotated[int, Bounds(minimum=FEWEST)]] = (50, 100, 200)  # numbers of samples that are learned from
    orders: Count = 3  # of the samples; a size takes the first samples of each
    classifier: GPCSettings = field(default_factory=GPCSettings)

    def chunks(self) -> list[int]:
        """Sizes of the chunks, as even as possible."""
        count = -(-self.further // self.chunk)
        return [self.further // count + (number < self.further % count) for number in range(count)]


def labeled_samples(causes: Mapping[str, Any]) -> int:
    """Number of training samples of the config's section ``causes`` that have a label."""
    parts = apportion(causes["train"], causes["shares"])
    return causes["train"] - parts[BORDERLINE] - parts[GEOMETRY]


def learning_samples(job: Job) -> None:
    """Draw, describe and label the samples of one chunk, independently of all other chunks."""
    chunk = int(job.chunk)
    wanted = read_settings(CurveSettings, job.section("learning_curve")).chunks()[chunk]
    icp = job.section("icp")
    settings = CauseSettings.from_dict(job.section("causes"), icp)
    with record_provenance([job.samples], [job.objects], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        samples = describe(draw_further(objects, job.source, job.seed, settings, chunk, wanted), ICPSettings(**icp))
        samples.subset(np.isin(samples.concept, LABELS)).save(job.samples, job.axes)


def describe(causes: Causes, icp: ICPSettings) -> LabeledSamples:
    """Labels of all rows, and those descriptors that need no further registration."""
    title = "descriptors of {}, seed {}".format(*(causes.registrations.axes or ("", 0)))
    rows = progress(range(len(causes)), title)
    described = [describe_plainly(observed_pair(causes, row), icp) for row in rows]  # nothing in these is random
    groups: dict[str, Any] = {name: np.array([groups[name] for groups in described]) for name in QUICK}
    return LabeledSamples(**groups, concept=labels_of(causes.truth), cluster=causes.registrations.cluster)


def learn_from_more(job: Job) -> None:
    """Pool the training samples of all sources, and learn from more and more of them."""
    settings = read_settings(CurveSettings, job.section("learning_curve"))
    inputs = [*job.causes, *job.descriptors, *job.samples]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        sets = {}
        for path, descriptors in zip(job.causes, job.descriptors, strict=True):
            causes = Causes.load(path)
            registrations = with_what_it_reads(labeled(causes), DESCRIBED, descriptors)
            sets[registrations.axes or job.axes] = causes, registrations
        causes, registrations = sets[job.axes]
        test = causes.rows("test")
        parts = [LabeledSamples.of(every.subset(training_rows(every, job.causes[0]))) for _, every in sets.values()]
        parts += [LabeledSamples.load(path) for path in job.samples]
        pool = joined_without(registrations.cluster[test], parts)
        tested = LabeledSamples.of(registrations.subset(test))
        write_csv(job.out, learning_curve(pool, tested, causes.subset(test), settings, *job.axes))


def learning_curve(
    pool: LabeledSamples, tested: LabeledSamples, truth: Causes, settings: CurveSettings, source: str, seed: int
) -> Frame:
    """Return `CURVE_COLUMNS` for each learner, size and order, and a row of the truth from other starts."""
    import pandas as pd

    sizes = [size for size in sorted(settings.sizes) if size <= len(pool)]
    if not sizes:
        fault = f"{len(pool)} training samples of other families are fewer than the least size, {min(settings.sizes)}"
        raise InputError(f"learning curve of {source}", fault, "raise learning_curve.further or lower its sizes")
    draws = [generator(source, seed, "learning curve", "order", i) for i in range(settings.orders)]
    orders = [random.permutation(len(pool)) for random in draws]

    def values(judged: Judged) -> list[float]:
        measured = measure(judged, np.ones((1, len(judged))))
        return [float(measured[name][0]) for name in MEASURED]

    rows = [(CEILING, 0, 0, *values(ceiling_of(truth, seed)))]
    fits = [(name, size, i) for size in sizes for i in range(settings.orders) for name in LEARNERS]
    for name, size, i in progress(fits, f"learning curve of {source}, seed {seed}"):
        learned, axes = pool.subset(orders[i][:size]), (source, seed, "learning curve", name, size, i)
        scores_N_4 = _scores(name, learned, tested.features, settings.classifier, *axes)
        attribution = Attribution.of_scores(LABELS, scores_N_4)
        judged = judged_by(prediction_frame(truth.registrations, attribution), truth, seed)
        rows.append((name, size, i, *values(judged)))
    return pd.DataFrame(rows, columns=list(CURVE_COLUMNS))


def _scores(
    name: str, learned: LabeledSamples, tested_N_F: np.ndarray, settings: GPCSettings, *axes: object
) -> np.ndarray:
    """Scores (N, 4) by extremely randomized trees, or by the classifier on ranks of the descriptors (``gpca_pair``)."""
    from sklearn.ensemble import ExtraTreesClassifier

    from gpca.classifier.gpc import GPC
    from gpca.explainers.classifiers import known_concepts, scores_of
    from gpca.explainers.pair_classifier import NormalizedFeatures

    known_concepts(learned.concept, LABELS)
    if name == "trees":
        state = seed_of(*axes) % 2**32
        forest = ExtraTreesClassifier(TREES, min_samples_leaf=2, max_features=0.3, random_state=state)
        return scores_of(forest.fit(learned.features, learned.concept), tested_N_F, LABELS)
    normalized = NormalizedFeatures(*axes).fit(learned.features)
    gpc = GPC(LABELS, settings, *axes[:2]).fit(normalized(learned.features), learned.concept)
    return gpc.attribute(normalized(tested_N_F))[0]
