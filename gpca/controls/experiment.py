"""Every explainer under every control: what it says of the test samples of one source and seed."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.controls.rivals import Embed, Rival, described_for
from gpca.controls.settings import PAPER, RELABELLED, RETRAINED, TRANSFER, ControlSettings
from gpca.controls.variants import left_out, relabelled, variant
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.evaluation import evaluate_design
from gpca.uncertainty.settings import UncertaintySettings

if TYPE_CHECKING:
    import pandas as pd

PARTS, FEWEST_OF_PART = 5, 60  # of the training samples whose labels are shuffled
LABELS = ("control", "tested", "explainer")  # columns before those of a prediction file


@dataclass(frozen=True)
class Experiment:
    """What all controls of one source and seed have in common.

    Attributes:
        source, seed: name what is random.
        settings: of the controls.
        backbone: of the encoder.
        uncertainty: of Monte-Carlo ICP, for explainers that read a covariance; its ICP is that of the registrations.
        rivals: by name.
        embed: registrations and the name of their source -> embeddings and head's logits by the paper's encoder.
        embeddings: ``embedding`` and ``head_logits`` by the paper's encoder, and by that of each control that has one.
    """

    source: str
    seed: int
    settings: ControlSettings
    backbone: str
    uncertainty: UncertaintySettings
    rivals: Mapping[str, Rival]
    embed: Embed
    embeddings: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)

    def run(self, registrations: Registrations, others: Mapping[str, Registrations]) -> pd.DataFrame:
        """Return a row for each control, explainer and test sample.

        Args:
            registrations: of the source, by the paper's protocol.
            others: those of the other sources, for transfer.

        Returns:
            the columns of a prediction file after ``control``, ``tested`` (the source of the sample) and ``explainer``.
            A control that the registrations do not admit has no rows, and is named on stderr.
        """
        import pandas as pd

        plain = self._described(replace(registrations, attached=dict(self.embeddings[PAPER])), self.source)
        tests = {self.source: plain.subset(plain.rows("test"))}
        admitted = [control for control in self.settings.controls if self._admits(control, registrations, others)]
        if TRANSFER in admitted:
            tests |= {name: self._asked(name, of_other) for name, of_other in others.items()}
        frames = list(self._explained(PAPER, plain, tests))
        for control in admitted:
            if control != TRANSFER:
                changed = self._changed(control, plain)
                frames += self._explained(control, changed, {self.source: changed.subset(changed.rows("test"))})
        return pd.concat(frames, ignore_index=True)

    def _admits(self, control: str, registrations: Registrations, others: Mapping) -> bool:
        why = left_out(control, registrations, self.settings, self.backbone)
        if control == TRANSFER and not others:
            why = "it needs two sources or more"
        if why:
            print(f"controls of {self.source}: '{control}' is left out: {why}", file=sys.stderr)
        return not why

    def _asked(self, source: str, registrations: Registrations) -> Registrations:
        """Return the test samples of another source as the paper's encoder of this one sees them."""
        test = registrations.subset(registrations.rows("test"))
        return self._described(self._embedded(test, source), source)

    def _changed(self, control: str, plain: Registrations) -> Registrations:
        """Return the registrations under a control, with all that explainers read attached."""
        changed = variant(control, plain, self.source, self.seed, self.settings, self.uncertainty.icp)
        if control == "unseen_objects":  # what was measured of each stays
            return replace(changed, attached={**changed.attached, **self.embeddings[control]})
        if control in RETRAINED:
            return self._described(replace(changed, attached=dict(self.embeddings[control])), self.source)
        return self._described(self._embedded(changed, self.source), self.source) if control == "reversed" else changed

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
        self, control: str, learnt: Registrations, tests: Mapping[str, Registrations]
    ) -> Iterator[pd.DataFrame]:
        """Yield what each explainer says of the test samples after learning from the training samples."""
        for train, asked in self._lessons(control, learnt.subset(learnt.rows("train")), tests):
            for name, rival in self.rivals.items():
                explainer = rival.make()
                if control in RELABELLED and getattr(explainer, "trained_with_encoder", False):
                    continue
                explainer.fit(train)
                for tested, test in asked.items():
                    frame = prediction_frame(test, explainer.explain(test.without_labels()))
                    of_test = control if tested == self.source else TRANSFER
                    for place, entry in enumerate(zip(LABELS, (of_test, tested, name), strict=True)):
                        frame.insert(place, *entry)
                    yield frame

    def _lessons(
        self, control: str, train: Registrations, tests: Mapping[str, Registrations]
    ) -> Iterator[tuple[Registrations, Mapping[str, Registrations]]]:
        """Yield training samples, and the test samples that are asked of what has learnt from them.

        Labels that say nothing make an explainer name a whole cluster of samples by chance. So they are shuffled in
        parts, of which each is learnt from alone and asked about a part of the test samples.
        """
        if control not in RELABELLED:
            yield train, tests
        elif control != "shuffled":
            yield relabelled(control, train, self.source, self.seed), tests
        else:
            parts = max(1, min(PARTS, len(train) // FEWEST_OF_PART))
            for part in range(parts):
                of_part = relabelled(control, _dealt(train, part, parts), self.source, self.seed, part)
                yield of_part, {name: _dealt(test, part, parts) for name, test in tests.items()}


def _dealt(registrations: Registrations, part: int, parts: int) -> Registrations:
    """Return one part of the samples, which are dealt out in threes: one object under every concept."""
    return registrations.subset(np.flatnonzero(np.arange(len(registrations)) // len(CONCEPTS) % parts == part))
