"""Step ``scan_causes``: a data set of scans -> measured causes of registrations, and what explainers read of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import scale_translation
from gpca.causes.descriptors import describe_all
from gpca.causes.scans import ScanStart, measure_scans, motion_between
from gpca.causes.settings import OBSERVED, CauseSettings, DescriptorSettings
from gpca.experiments.scan_causes.samples import GlobalMethod, starts_of
from gpca.experiments.scan_causes.settings import ScanSamples
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.scans import reenact_scans
from gpca.reenactment.settings import ReenactmentSettings
from gpca.scans.pair import ScanPair, ScanSuccess
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator
from gpca.settings import fields_of, read_settings
from gpca.steps.scan_trials import TrialSettings, pair_to_register
from gpca.steps.scans import drawn_pairs


def run(job: Job) -> None:
    """Draw pairs and starts, measure what made the registrations fail, describe and re-enact them."""
    own = read_settings(ScanSamples, job.section("samples"))
    outputs = [job.scan_causes, job.samples, job.descriptors, job.reenactments]
    with record_provenance(outputs, job.get("data", []), job.settings, seed=job.seed):
        axes, section = (job.source, job.seed), job.section("scans")
        chosen = drawn_pairs(job, section | {"pairs": own.pairs})
        kept = np.sort(generator(*axes, "scan causes", "pairs").permutation(len(chosen))[: own.most_pairs])
        pairs = ScanPairs.of([chosen[k] for k in kept])
        truth = truth_settings(job.section("causes"), own)
        trials = read_settings(TrialSettings, fields_of(section, TrialSettings))
        methods = global_methods(trials, job.section("methods"), *axes) if own.global_start else {}
        starts = starts_of(pairs, *axes, own, trials.ladder, methods)
        success = read_settings(ScanSuccess, section.get("success") or {})
        causes, samples = measure_scans(pairs, starts, *axes, truth, success, own.points)
        causes.save(job.scan_causes)
        write_csv(job.samples, samples)
        descriptors = DescriptorSettings(**job.section("descriptors"))
        describe_all(causes, *axes, descriptors, truth.icp)[0].save(job.descriptors)
        factor_S = samples["error_factor"].to_numpy()
        measured = [starts[number] for number in samples["sample"]]
        T_found_S = [found_from(pairs[start.pair], start) for start in measured]
        reenactment = read_settings(ReenactmentSettings, job.section("reenactment"))
        reenact_scans(causes, factor_S, reenactment, truth, T_found_S).save(job.reenactments)


def global_methods(
    settings: TrialSettings, methods: Mapping[str, Mapping | None], *axes: object
) -> dict[str, GlobalMethod]:
    """Return the global method at whose pose local ones start, as Table XVII runs it.

    Args:
        methods: its settings, by name.
        axes: name its draws.
    """
    name = settings.global_start
    align = make_method(name, methods.get(name))

    def register(pair: ScanPair) -> np.ndarray | None:
        outcome = align(pair_to_register(pair, settings.ladder[0], settings, *axes))
        return scale_translation(outcome.T_target_source, pair.scale) if outcome.converged else None

    return {name: register}


def found_from(pair: ScanPair, start: ScanStart) -> np.ndarray:
    """Return the motions (k, 4, 4) from where a registration begins to where global methods put the source."""
    motions = [motion_between(pair, start.T_target_source, found) for found in start.found]
    return np.array(motions).reshape(-1, 4, 4)


def truth_settings(causes: dict, samples: ScanSamples) -> CauseSettings:
    """Return how counterfactuals of scans are registered: as those of objects, but the source onto the target."""
    icp = {"correspondence_distance": samples.icp.correspondence_distance, "max_iterations": samples.icp.max_iterations}
    return CauseSettings.from_dict(causes | {"moved": OBSERVED}, icp)
