"""Step ``explain_controls``: registrations and embeddings -> predictions of every explainer under every control."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pandas as pd

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.causes.descriptors import joined_without
from gpca.classifier.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.explainers.interface import EMBEDDINGS, REENACTED, Encoding, ExplainerEntry, answer_of
from gpca.explainers.registry import Embed, described_for, make_rivals
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import fields_of, read_settings
from gpca.steps import control_samples as samples
from gpca.steps.control_samples import HARD, LABELS, PAPER, RELABELED, RETRAINED, TRANSFER, UNSEEN
from gpca.steps.diagnosis import with_what_it_reads
from gpca.uncertainty.designs import evaluate_design
from gpca.uncertainty.settings import UncertaintySettings

PARTS, FEWEST_OF_PART = 5, 60  # of the training samples whose labels are shuffled
Attach = Callable[[Registrations], Registrations]


def explain(job: Job) -> None:
    from gpca.encoders.training import embedding_by, load_model

    rivals = make_rivals(job.section("explainers"), job.source, job.seed)
    settings = read_settings(samples.ControlSettings, job.section("controls"))
    encoder = EncoderSettings(**job.section("encoder"))
    icp = ICPSettings(**job.section("icp"))
    uncertainty = UncertaintySettings(**fields_of(job.section("uncertainty"), UncertaintySettings), icp=icp)
    retrained = dict(zip(job.retrained, job.retrained_embeddings, strict=True))
    others = dict(zip(job.others, job.other_registrations, strict=True))
    inputs = [job.registrations, job.encoder, job.embeddings]
    inputs += [*retrained.values(), *others.values(), *job.get("all_hard", []), *job.get("all_hard_reenactments", [])]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, job.axes)
        all_hard = read_hard(job.get("all_hard", []), job.get("all_hard_reenactments", []), job.seed)
        embeddings = {PAPER: read_embedding(job.embeddings, registrations, logits=True)}
        for control, path in retrained.items():
            if control == HARD:
                hard = all_hard[job.source]
                embeddings[control] = {**hard.attached, **read_embedding(path, hard, logits=True)}
            elif not samples.left_out(control, registrations, settings, encoder.backbone):
                changed = samples.variant(control, registrations, *job.axes, settings, icp)
                embeddings[control] = read_embedding(path, changed, logits=True)
        embed = embedding_by(load_model(job.encoder, encoder, axes=job.axes), job.seed, encoder)
        own = all_hard.pop(job.source, None)
        experiment = ControlRun(
            *job.axes, settings, encoder.backbone, uncertainty, rivals, embed, embeddings, own, [*all_hard.values()]
        )
        asked = {name: Registrations.load(path, (name, job.seed)) for name, path in others.items()}
        write_csv(job.predictions, experiment.run(registrations, asked))


def read_hard(paths: Sequence[Path], reenactments: Sequence[Path], seed: int) -> dict[str, Registrations]:
    """Return hard samples by source, with their re-enactments where files of these are given."""
    return {
        path.parent.name: with_what_it_reads(Registrations.load(path, (path.parent.name, seed)), REENACTED, enacted)
        for path, enacted in zip_longest(paths, reenactments)
    }


@dataclass(frozen=True)
class ControlRun:
    """The parts that all controls of one source and seed share."""

    source: str
    seed: int
    settings: samples.ControlSettings
    backbone: str  # of the encoder
    uncertainty: UncertaintySettings  # of Monte-Carlo ICP, for covariances; its ICP is that of the registrations
    rivals: Mapping[str, ExplainerEntry]
    embed: Embed  # by the paper's encoder
    # ``embedding`` and ``head_logits`` by the paper's encoder, and by that of each control that has one
    embeddings: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    hard: Registrations | None = None  # the samples of that control
    other_hard: Sequence[Registrations] = ()  # those of the other sources, whose training samples are learned from too

    def run(self, registrations: Registrations, others: Mapping[str, Registrations]) -> pd.DataFrame:
        """Rows of a prediction file after `LABELS`, under each control that the registrations, the paper's, admit."""
        plain = self._described(replace(registrations, attached=dict(self.embeddings[PAPER])), self.source)
        embeds = self._learned(plain)
        plain = _attached(embeds, plain)
        tests = {(PAPER, self.source): plain.subset(plain.rows("test"))}
        admitted = []
        for control in self.settings.controls:
            why = samples.left_out(control, registrations, self.settings, self.backbone)
            if control == TRANSFER and not others:
                why = "it needs at least two sources"
            if control == HARD and self.hard is None:
                why = "it needs samples of its own"
            if why:
                print(f"controls of {self.source}: '{control}' is skipped: {why}", file=sys.stderr)
            else:
                admitted.append(control)
        if TRANSFER in admitted:  # test samples of other sources with embeddings by the encoders of this one
            for name, other in others.items():
                test = self._embedded(other.subset(other.rows("test")), name)
                tests[TRANSFER, name] = _attached(embeds, self._described(test, name))
        frames = list(self._explained(PAPER, plain, tests))
        for control in admitted:
            if control != TRANSFER:
                changed = self._changed(control, plain, embeds)
                asked = {(str(control), self.source): changed.subset(changed.rows("test"))}
                frames += self._explained(control, changed, asked)
        return pd.concat(frames, ignore_index=True)

    def explain_hard(self, name: str) -> tuple[Attribution, float]:
        """Attribution of the hard test samples by one explainer, and its seconds for each of them."""
        assert self.hard is not None
        changed = self._changed(HARD, self.hard, [])
        explainer, test = self.rivals[name].made(), changed.subset(changed.rows("test"))
        explainer.fit(_learned_from(self.rivals[name], changed.subset(changed.rows("train"))))
        attribution = answer_of(explainer, test.without_labels())
        return attribution, float(attribution.seconds_N.mean())

    def _changed(self, control: str, plain: Registrations, embeds: list[Attach]) -> Registrations:
        """Registrations under a control, with all that explainers read attached."""
        if control == HARD and self.hard is not None:
            changed = self._described(self._with_others(self.hard), self.source)
            return _attached(self._learned(changed), changed)
        changed = samples.variant(control, plain, self.source, self.seed, self.settings, self.uncertainty.icp)
        if control == UNSEEN:  # the measurements of each stay
            changed = replace(changed, attached={**changed.attached, **self.embeddings[control]})
        elif control in RETRAINED:
            changed = self._described(replace(changed, attached=dict(self.embeddings[control])), self.source)
        elif control == "reversed":
            return _attached(embeds, self._described(self._embedded(changed, self.source), self.source))
        return _attached(self._learned(changed), changed) if control in RETRAINED else changed

    def _with_others(self, hard: Registrations) -> Registrations:
        """Join hard samples with those that other sources learn from, but of no family that is tested."""
        own = replace(hard, attached={**hard.attached, **self.embeddings[HARD]})
        if not self.other_hard:
            return own
        test, parts = own.subset(own.rows("test")), [own.subset(own.rows("train"))]
        for other in self.other_hard:
            train = other.subset(other.rows("train"))
            # They have no embedding, which would be by another encoder.
            unknown = {name: np.full((len(train), *own_S.shape[1:]), np.nan) for name, own_S in own.attached.items()}
            parts.append(replace(train, attached={**unknown, **train.attached}))
        return Registrations.joined([joined_without(test.cluster, parts), test])

    def _learned(self, registrations: Registrations) -> list[Attach]:
        """Functions that attach embeddings by the rivals' encoders, trained on the training samples."""
        train, made = registrations.subset(registrations.rows("train")), (each.made() for each in self.rivals.values())
        return [explainer.learn_encoder(train) for explainer in made if isinstance(explainer, Encoding)]

    def _embedded(self, registrations: Registrations, source: str) -> Registrations:
        h_S_d, logits_S_C = self.embed(registrations, source)
        return replace(registrations, attached={"embedding": h_S_d, "head_logits": logits_S_C})

    def _described(self, registrations: Registrations, source: str) -> Registrations:
        """Attach what the explainers measure of each registration, once for all controls of its clouds."""
        described = registrations
        if any(rival.reads.startswith("uncertainty/") for rival in self.rivals.values()):
            outcomes, *seconds = evaluate_design("observed", described, source, self.seed, self.uncertainty)
            described = outcomes.attach_to(described, *seconds)
        return described_for(self.rivals, described)

    def _explained(
        self, control: str, learned: Registrations, tests: Mapping[tuple[str, str], Registrations]
    ) -> Iterator[pd.DataFrame]:
        """Yield each explainer's predictions for the test samples after it has learned from the training samples.

        Labels without information make an explainer name a whole cluster by chance. So shuffled ones are learned in
        parts: an explainer learns from one part and explains one part of the test samples.
        """
        whole, axes = learned.subset(learned.rows("train")), (self.source, self.seed)
        parts = max(1, min(PARTS, len(whole) // FEWEST_OF_PART)) if control == "shuffled" else 1
        for part in range(parts):
            train, asked = _dealt(whole, part, parts), {key: _dealt(test, part, parts) for key, test in tests.items()}
            if control in RELABELED:
                train = samples.relabeled(control, train, *axes, *([part] if control == "shuffled" else []))
            for name, rival in self.rivals.items():
                explainer = rival.made()
                knows_labels = control in RELABELED and getattr(explainer, "trained_with_encoder", False)
                if knows_labels or (control != HARD and rival.reads == REENACTED):
                    continue
                explainer.fit(_learned_from(rival, train))
                for (name_of_test, source), test in asked.items():
                    labels = dict(zip(LABELS, (name_of_test, source, name), strict=True))
                    yield prediction_frame(test, answer_of(explainer, test.without_labels()), **labels)


def _learned_from(rival: ExplainerEntry, train: Registrations) -> Registrations:
    """Return the training samples for an explainer: where it reads embeddings, those that have one."""
    if rival.reads != EMBEDDINGS:
        return train
    return train.subset(np.flatnonzero(np.isfinite(train.embedding).all(axis=1)))


def _attached(embeds: list[Attach], registrations: Registrations) -> Registrations:
    return reduce(lambda registered, embed: embed(registered), embeds, registrations)


def _dealt(registrations: Registrations, part: int, parts: int) -> Registrations:
    """One part of the samples, which are dealt out in threes: one object under every concept."""
    return registrations.subset(np.flatnonzero(np.arange(len(registrations)) // len(CONCEPTS) % parts == part))
