"""The steps of causes on scans: measured causes, and answers by what learned from objects or scans of other folds."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gpca.alignment.methods.registry import make_method
from gpca.attribution.predictions import prediction_frame
from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import describe_all
from gpca.causes.scans import GLOBAL, LADDER, ScanStart, measure_scans, motion_between
from gpca.causes.settings import OBSERVED, CauseSettings, DescriptorSettings, ScanSamples
from gpca.errors import InputError
from gpca.explainers.interface import REENACTED
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations
from gpca.reenactment.scans import reenact_scans
from gpca.reenactment.settings import ReenactmentSettings
from gpca.rigid import scale_translation
from gpca.scans.pair import Rung, ScanPair, ScanSuccess, disturbed
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator
from gpca.settings import fields_of, read_settings
from gpca.steps.diagnosis import DESCRIBED, World, learned_files, with_what_it_reads
from gpca.steps.scans import TrialSettings, drawn_pairs, pair_to_register

GlobalMethod = Callable[[ScanPair], np.ndarray | None]  # returns T_target_source (4×4), meters; None where it fails


def measure(job: Job) -> None:
    """Draw pairs and starts, measure what made the registrations fail, describe and re-enact them."""
    settings = read_settings(ScanSamples, job.section("samples"))
    outputs = [job.scan_causes, job.samples, job.descriptors, job.reenactments]
    with record_provenance(outputs, job.get("data", []), job.settings, seed=job.seed):
        axes, section = job.axes, job.section("scans")
        chosen = drawn_pairs(job, section | {"pairs": settings.pairs})
        kept = np.sort(generator(*axes, "scan causes", "pairs").permutation(len(chosen))[: settings.most_pairs])
        pairs = ScanPairs.of([chosen[k] for k in kept])
        # Counterfactuals are registered as those of objects, but the source onto the target.
        icp = {name: getattr(settings.icp, name) for name in ("correspondence_distance", "max_iterations")}
        truth = CauseSettings.from_dict(job.section("causes") | {"moved": OBSERVED}, icp)
        trials = read_settings(TrialSettings, fields_of(section, TrialSettings))
        methods = {}
        if settings.global_start:
            methods[trials.global_start] = global_method(trials, job.section("methods"), *axes)
        starts = starts_of(pairs, *axes, settings, trials.ladder, methods)
        success = read_settings(ScanSuccess, section.get("success") or {})
        causes, samples = measure_scans(pairs, starts, *axes, truth, success, settings.points)
        causes.save(job.scan_causes)
        samples["stands_for"] = samples["pair"].map({pair.name: pair.stands_for for pair in chosen})
        write_csv(job.samples, samples)
        descriptors = DescriptorSettings(**job.section("descriptors"))
        describe_all(causes, *axes, descriptors, truth.icp)[0].save(job.descriptors)
        T_found_S = []  # motions (k, 4, 4) from the start of each registration to the results of global methods
        for start in (starts[number] for number in samples["sample"]):
            motions = [motion_between(pairs[start.pair], start.T_target_source, found) for found in start.found]
            T_found_S.append(np.array(motions).reshape(-1, 4, 4))
        reenactment = read_settings(ReenactmentSettings, job.section("reenactment"))
        reenact_scans(causes, samples["error_factor"].to_numpy(), reenactment, truth, T_found_S).save(job.reenactments)


def global_method(settings: TrialSettings, methods: Mapping[str, Mapping | None], *axes: object) -> GlobalMethod:
    """The global method at whose pose local ones start, as Table XVII runs it, given settings by name."""
    align = make_method(settings.global_start, methods.get(settings.global_start))

    def register(pair: ScanPair) -> np.ndarray | None:
        outcome = align(pair_to_register(pair, settings.ladder[0], settings, *axes))
        return scale_translation(outcome.T_target_source, pair.scale) if outcome.converged else None

    return register


def starts_of(
    pairs: ScanPairs,
    source: str,
    seed: int,
    settings: ScanSamples,
    ladder: Sequence[Rung],
    methods: Mapping[str, GlobalMethod],
) -> list[ScanStart]:
    """Return starts of each pair: drawn rungs with an error, the poses of global methods, and a rung with noise."""
    rungs = [rung for rung in ladder if rung.rotation_deg or rung.translation_m]
    starts: list[ScanStart] = []
    for k, pair in enumerate(pairs):
        order = generator(source, seed, "scan causes", pair.name, "rungs").permutation(len(rungs))
        drawn = [rungs[row] for row in order[: settings.ladder_starts]]
        poses = {rung.name: disturbed(pair, rung, source, seed) for rung in drawn}
        results = {name: register(pair) for name, register in methods.items()}
        converged = {name: pose for name, pose in results.items() if pose is not None}
        global_poses = tuple(converged.values())
        starts += [ScanStart(k, LADDER, name, pose, found=global_poses) for name, pose in poses.items()]
        starts += [ScanStart(k, GLOBAL, name, pose, found=global_poses) for name, pose in converged.items()]
        if settings.times and drawn:
            times = settings.times[k % len(settings.times)]
            starts.append(ScanStart(k, LADDER, drawn[0].name, poses[drawn[0].name], times, global_poses))
    return starts


def diagnose(job: Job) -> None:
    """Ask every explainer about the registrations of all data sets of scans (column ``scans``) -> its predictions."""
    import pandas as pd

    scans = [job.scan_causes, job.scan_descriptors, job.scan_reenactments]
    training = learned_files(job)
    inputs = [path for files in (*scans, *training.values()) for path in files]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        measured, parts = [], []
        for path, described, enacted in zip(*scans, strict=True):
            causes = Causes.load(path)
            measured.append(causes.registrations)
            registrations = with_what_it_reads(labeled(causes), DESCRIBED, described)
            parts.append(with_what_it_reads(registrations, REENACTED, enacted))
        whole = Registrations.joined(parts)
        sample_S = np.concatenate([registrations.sample for registrations in measured])
        concept_S = np.concatenate([registrations.concept for registrations in measured])
        shown = replace(whole, sample=sample_S, concept=concept_S)
        data_set_S = np.repeat([path.parent.name for path in job.scan_causes], [*map(len, measured)])
        labels_alone = replace(whole, attached={"causes": whole.attached["causes"]})
        fold_S = folds_of(whole.cluster, read_settings(ScanSamples, job.section("samples")).folds)
        world = World(job, training, labels_alone, job.section("causes")["starts"], lambda _: whole, fold_S)
        frames: list[pd.DataFrame] = []
        for name, learned_from in job.section("explainers").items():
            for learned in learned_from:
                attribution = world.attribution(name, job.section("settings").get(name) or {}, learned)
                if attribution is None:
                    fault = "is left out: what it would learn from has fewer than two labels"
                    print(f"explainer '{name}', learned from {learned}, {fault}", file=sys.stderr)
                    continue
                predicted = prediction_frame(shown, attribution)
                frames.append(predicted.assign(scans=data_set_S, learned=learned, explainer=name))
        if not frames:
            remedy = "raise scan_causes.pairs, or let an explainer learn from objects"
            raise InputError("predictions of scans", "no explainer has anything to learn from", remedy)
        write_csv(job.predictions, pd.concat(frames))


def folds_of(cluster_S: np.ndarray, most: int) -> np.ndarray:
    """Fold (S,) of each row; clusters are divided into folds, `most` at most."""
    clusters, number_S = np.unique(cluster_S, return_inverse=True)
    return number_S % min(most, len(clusters))
