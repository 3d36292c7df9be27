"""The printed numbers of Tables I to V under joint readings: measured on development samples, searched, and run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gpca.active_learning.rounds import make_task
from gpca.active_learning.settings import LOOK_EVERY, ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.comparison import joint_reading as reading
from gpca.comparison.joint_reading import CHOICES, DEVELOPMENT, EVALUATED, PROTOCOL, SEVERITIES, Joint, part_name
from gpca.comparison.published import read_published
from gpca.comparison.verdicts import Tolerance
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, read_all_metrics, tidy, write_metrics
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import finite_number, write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.shifted_sets import DISTANCES, ShiftedSets
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.progress import progress
from gpca.seeds import seed_of_file
from gpca.settings import read_settings
from gpca.steps.readings import learners
from gpca.steps.readings.files import RunFiles, accuracies, diagnostics_of_scores, like_the_training, train_and_test
from gpca.steps.readings.knobs import accuracies_of_magnitudes, runs_of
from gpca.steps.readings.labels import NEW, passes_to, until
from gpca.steps.readings.learners import FITTED, FOREST, SVM, StartedGPC, method_of, relevant, scheduled
from gpca.uncertainty.interventions import MIDDLE, UPPER
from gpca.uncertainty.settings import UncertaintySettings

TABLE = "joint_reading"  # `table` of the tidy rows of the reading that was found
LOWER = (0.01, 1.5, 0.20)  # the knobs at the lower ends of the severities
KNOBS = {"low": LOWER, "middle": MIDDLE, "high": UPPER}
SCHEDULES = {"rbf": ("rbf", 0.01, 100), "matern32": ("matern32", 0.01, 200)}  # of a kernel in all tables but IV
PRINTED = (*FITTED, ("polynomial", 0.01, 200))  # kernel, rate and iterations of Table IV's rows
RANDOM_ROUND = 25  # random choice is the same in rounds of any size, and needs many labels
Choices = Mapping[str, Sequence]
Value = tuple[str, str, str, str, float]  # part, method, metric, concept, value


@dataclass(frozen=True)
class ReadingSamples:
    """Samples of a source and seed."""

    sets: ShiftedSets  # with embeddings by an encoder that learned from samples of the same severities
    pairs: Registrations  # some of the test samples like the training's, for Monte-Carlo ICP
    axes: tuple[str, int]

    @classmethod
    def load(cls, job: Job, sets: Path, seed: int, registrations: dict) -> ReadingSamples:
        """Read the sets, and make some of their pairs anew, by settings that have the severities of the sets."""
        settings, axes = read_settings(RegistrationSettings, registrations), (job.source, seed)
        few = replace(settings, train=0, test=min(job.section("sizes")["samples"], settings.test))
        pairs, _ = make_registrations(ObjectClouds.load(job.objects, job.source), *axes, few)
        return cls(ShiftedSets.load(sets, axes), pairs, axes)

    def test_sets(self) -> dict[str, Registrations]:
        """Test samples of the sets whose samples are embedded by the encoder itself."""
        names = ("in_distribution", "severity")
        return {name: self.sets.registrations(self.sets.rows(name, "test")) for name in names}


@dataclass(frozen=True)
class MeasureSettings:
    """What joint readings leave as it is."""

    gpc: dict[str, Any]  # the paper's setting, of which the reading changes kernel, rate and iterations
    labels: ActiveLearningSettings
    target: float  # accuracy that counts as reached
    uncertainty: UncertaintySettings

    @classmethod
    def of_job(cls, job: Job) -> MeasureSettings:
        """Read a job's sections, of which ``labels`` changes ``active_learning``."""
        active, uncertainty = job.section("active_learning"), RunFiles(settings=job.settings).uncertainty()
        labels = ActiveLearningSettings.from_dict(active | job.section("labels"))
        return cls(job.section("gpca_paper"), labels, active["target"], uncertainty)


def measure(job: Job) -> None:
    """Values on development samples of some severities under every combination of the other choices."""
    with record_provenance([job.out], [job.objects, job.sets], job.settings, seed=job.seed):
        samples = ReadingSamples.load(job, job.sets, job.seed, job.section("registrations"))
        measured = values(samples, job.severities, job.section("choices"), MeasureSettings.of_job(job))
        records = [(part, job.source, *named, job.seed, value) for part, *named, value in measured]
        write_metrics(tidy(records, "joint readings"), job.out)


def choose(job: Job) -> None:
    """Find the joint reading with the largest share of close numbers, the best ones, and the share by chance."""
    import pandas as pd

    tolerances = {unit: Tolerance(**tolerance) for unit, tolerance in job.section("tolerances").items()}
    published = read_published()
    numbers, printed = reading.numbers_asked(published, [job.settings["stands_for"]]), reading.numbers_asked(published)
    files = job.files("measured")
    with record_provenance([job.choice, job.best, job.scores], files, job.settings):
        measured = read_all_metrics(files)
        found = reading.search(numbers, printed, measured, job.section("choices"), tolerances, job.settings["deals"])
        chosen = [(choice, reading.text_of(found.joint[choice])) for choice in CHOICES]
        write_csv(job.choice, pd.DataFrame(chosen, columns=["choice", "value"]))
        best = [{"share": share, **{c: reading.text_of(joint[c]) for c in CHOICES}} for joint, share in found.best]
        write_csv(job.best, pd.DataFrame(best), form=None)
        records = reading.scores(numbers, found.close, found.share, found.by_chance)
        counts = {"readings": found.readings, "equals": found.equals, "share_of_protocol": found.protocol}
        records += [("all", EVALUATED, name, value) for name, value in counts.items()]
        rows = [(table, DEVELOPMENT, method, metric, "all", 0, float(v)) for table, method, metric, v in records]
        write_metrics(tidy(rows, "joint reading"), job.scores)


def apply(job: Job) -> None:
    """Values that the joint reading gives on a source's test samples of its severities, seed by seed."""
    joint = dict(reading.read_choices(job.choice).itertuples(index=False, name=None))
    joint["new_share"] = finite_number(job.choice, "new_share", joint["new_share"])
    severities = joint[SEVERITIES]
    files = job.files("sets")
    if severities != PROTOCOL:
        files = [path for path in job.get("other_sets", []) if path.parts[-3] == severities]
        if not files:
            fault = f"needs encoders of {severities} perturbations"
            raise InputError("joint reading", fault, "raise readings.encoders")
    registrations = job.section("registrations") | job.section("severities").get(severities, {})
    choices = {name: [value] for name, value in joint.items()}
    with record_provenance([job.out], [job.choice, job.objects, *files], job.settings):
        records = []
        for path in files:
            samples = ReadingSamples.load(job, path, seed_of_file(path), registrations)
            measured = values(samples, severities, choices, MeasureSettings.of_job(job))
            records += [(TABLE, job.source, *named, seed_of_file(path), value) for _, *named, value in measured]
        write_metrics(tidy(records, "joint reading"), job.out)


def values(samples: ReadingSamples, severities: str, choices: Choices, settings: MeasureSettings) -> Iterator[Value]:
    """Yield the values under every combination of these choices that matters to a part, with these severities."""
    choices = dict(choices) | {SEVERITIES: [severities]}
    uncertainty, title = settings.uncertainty, f"knobs of {samples.axes[0]}, seed {samples.axes[1]}"
    pairs = runs_of(samples.pairs, *samples.axes, uncertainty, uncertainty.starts, title)
    turned_R_3 = np.array([KNOBS[name] for name in choices["knobs"]])
    for method, value_R in accuracies_of_magnitudes(pairs, turned_R_3, uncertainty.floor).items():
        for joint, value in zip(_combinations(choices, (SEVERITIES, "knobs")), value_R, strict=True):
            yield part_name("knobs", joint), method, "accuracy", ALL, float(value)
    yield from _learner_values(samples, choices)
    train, test = train_and_test(like_the_training(samples.sets))
    fits: dict[tuple, GPC] = {}  # starts share those whose relevant choices agree
    starts = list(_combinations(choices, (SEVERITIES, *reading.START)))
    for start in progress(starts, f"joint readings of {' '.join(map(str, samples.axes))}, {severities}"):
        fitted = {}
        for schedule in PRINTED:
            key = (schedule, *relevant(start, schedule[0]).values())
            if key not in fits:
                started = StartedGPC(scheduled(settings.gpc, schedule), start, *samples.axes)
                fits[key] = started.fit(train.embedding, train.concept)
            fitted[schedule] = fits[key]
            right = accuracies(test.concept, fits[key].attribute(test.embedding)[0])
            yield part_name("schedules", start), method_of(schedule), "accuracy", ALL, right["accuracy", ALL]
        for kernel in choices["kernel"]:
            joint, gpc = start | {"kernel": kernel}, fitted[SCHEDULES[kernel]]
            # Accuracies of GP-CA in Tables I and II and of the GPC in V, and the diagnostics of the latter.
            right = accuracies(test.concept, gpc.attribute(test.embedding)[0])
            for (metric, concept), value in right.items():
                yield part_name("classifier", joint), "gpca_paper", metric, concept, value
            yield part_name("classifier", joint), "gpca_matern", "accuracy", ALL, right["accuracy", ALL]
            scored = {name: gpc.attribute(part.embedding)[0] for name, part in samples.test_sets().items()}
            yield from _diagnostics("diagnostics", "gpca_matern", scored, samples.sets, joint, choices)
            yield from _label_values(samples, joint, choices, settings)


def _learner_values(samples: ReadingSamples, choices: Choices) -> Iterator[Value]:
    """Yield accuracies and diagnostics of the forest and the linear SVM, by the scale of their inputs."""
    for joint in _combinations(choices, (SEVERITIES, "inputs")):
        scale = learners.to_unit_norm if joint["inputs"] == "unit_norm" else np.asarray

        def scaled(registrations: Registrations, scale: Callable = scale) -> Registrations:
            return replace(registrations, attached={"embedding": scale(registrations.embedding)})

        train = scaled(train_and_test(like_the_training(samples.sets))[0])
        forest = explainer_entry(FOREST).make(*samples.axes)
        forest.fit(train)
        parts = {name: scaled(part) for name, part in samples.test_sets().items()}
        h_S_d = np.concatenate([part.embedding for part in parts.values()])
        ends = np.cumsum([len(part) for part in parts.values()])[:-1]
        inputs = joint["inputs"] if joint["inputs"] == "standardised" else "raw"
        by_svm = np.split(learners.svm_scores(train, h_S_d, "svc", inputs, "platt"), ends)
        scored_by = {
            FOREST: {name: forest.explain(part).scores_N_C for name, part in parts.items()},
            SVM: dict(zip(parts, by_svm, strict=True)),
        }
        for method, scored in scored_by.items():
            right = accuracies(parts["in_distribution"].concept, scored["in_distribution"])["accuracy", ALL]
            yield part_name("learners", joint), method, "accuracy", ALL, right
            yield from _diagnostics("learner_diagnostics", method, scored, samples.sets, joint, choices)


def _diagnostics(
    part: str, method: str, scored: Mapping[str, np.ndarray], sets: ShiftedSets, joint: Joint, choices: Choices
) -> Iterator[Value]:
    """Yield ρ, AUC and ECE by set and distance, given the scores of each set's test samples."""
    for asked in _combinations(choices, ("set", "distance")):
        names = asked["set"].split("+")
        rows = np.concatenate([sets.rows(name, "test") for name in names])
        scores_S_C = np.concatenate([scored[name] for name in names])
        distance_S = sets.distance[rows, DISTANCES.index(asked["distance"])]
        for (metric, concept), value in diagnostics_of_scores(sets.concept[rows], scores_S_C, distance_S).items():
            yield part_name(part, joint | asked), method, metric, concept, value


def _label_values(
    samples: ReadingSamples, joint: Joint, choices: Choices, settings: MeasureSettings
) -> Iterator[Value]:
    """Yield Table III's numbers, by the share of the new concept in the pool."""
    with_kernel = scheduled(settings.gpc, SCHEDULES[joint["kernel"]])
    for new_share in choices["new_share"]:
        registrations = like_the_training(samples.sets)
        task = make_task(registrations, NEW, settings.labels, *samples.axes, new_share=new_share)
        gpc = StartedGPC(with_kernel, joint, *samples.axes, "reading", NEW)
        gpc.fit(task.initial.h, task.initial.concept_N, np.concatenate([task.initial.h, task.pool.h]))
        gpc.level()
        # Random choice has the whole pool, and ends at the target.
        budgets = {
            "bald_kmeans": (settings.labels, np.inf),
            "random": (replace(settings.labels, batch=RANDOM_ROUND, labels=len(task.pool)), settings.target),
        }
        for strategy, (budget, end) in budgets.items():
            steps, labeled = until(end, task, gpc, strategy, budget, *samples.axes)
            hits = [step["accuracy"] >= settings.target for step in steps]
            last = hits.index(True) if any(hits) else -1  # a lower bound where the target is missed
            metrics = {"labels_to_target": float(steps[last]["labels"]), "reached": float(any(hits))}
            metrics["final_accuracy"] = float(steps[-1]["accuracy"])
            if strategy == "bald_kmeans":  # passes over these labels, or all, to a new classifier's target accuracy
                anew, most = StartedGPC(with_kernel, joint, *samples.axes, "epochs", NEW), with_kernel.iterations
                looks = [*range(LOOK_EVERY, most, LOOK_EVERY), most]
                metrics["epochs_at_target"], _ = passes_to(settings.target, anew, task, labeled[last], looks)
            for metric, value in metrics.items():
                yield part_name("labels", joint | {"new_share": new_share}), strategy, metric, NEW, value


def _combinations(choices: Choices, names: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield every combination of the values of these choices."""
    for chosen in product(*(choices[name] for name in names)):
        yield dict(zip(names, chosen, strict=True))
