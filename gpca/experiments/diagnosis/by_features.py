"""Step ``diagnose_by_features``: descriptors -> predictions of learners that see more and more parts of a pair.

One job has all of a source, since each learner takes less time than a job needs to start.
"""

from __future__ import annotations

from gpca.attribution.predictions import write_predictions
from gpca.causes.dataset import Causes, labeled
from gpca.causes.settings import DescriptorSettings
from gpca.experiments.diagnosis.step import explained, with_what_it_reads
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.seeds import seed_of_file


def run(job: Job) -> None:
    """Let every learner learn and explain, seed by seed."""
    remedies = DescriptorSettings(**job.section("descriptors"))
    own = {(path.parts[-2], seed_of_file(path)): path for path in job.predictions}
    with record_provenance(job.predictions, [*job.causes, *job.descriptors], job.settings):
        for seed, causes_file, descriptors in job.per_seed("causes", "descriptors"):
            causes = Causes.load(causes_file, (job.source, seed))
            for name, settings in job.section("by_features").items():
                entry = explainer_entry(name, CAUSES)
                explainer = entry.make(job.source, seed, **(settings or {}))
                registrations = with_what_it_reads(labeled(causes), entry, descriptors)
                attribution = explained(explainer, entry, registrations, causes, remedies, causes_file)
                write_predictions(own[name, seed], causes.registrations, attribution)
