"""Registrations of a run with the results of all stages, one of which the figures of the method show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.alignment.pose_error import adds_error
from gpca.attribution.metrics import read_uncertainties
from gpca.attribution.predictions import read_predictions
from gpca.causes.settings import Limits
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.declarations import Frame, Run, Series
from gpca.errors import InputError
from gpca.io.container import require_same_samples
from gpca.io.csv_file import numbers
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import widest_views
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, SMALL_PT, blues
from gpca.reporting.words import object_in_words
from gpca.rigid import inverse, scale_translation, transform


@dataclass(frozen=True)
class Staged:
    """S registrations of one source and seed, with the results of all stages."""

    registrations: Registrations
    h_S_d: np.ndarray  # embeddings
    predictions: Frame  # of GP-CA
    u_S: np.ndarray  # uncertainty in nats, NaN where it is not known
    u_clean: float  # what 95 % of the clean pairs stay below, in nats
    limits: Limits  # of the errors, which decide the states

    @classmethod
    def load(
        cls,
        registrations_npz: str | Path,
        embeddings_npz: str | Path,
        predictions_csv: str | Path,
        uncertainty_csv: str | Path,
        limits: Mapping[str, float],
    ) -> Staged:
        """Read the files of the stages; the limits are those of the config's section ``causes``."""
        registrations, predictions = Registrations.load(registrations_npz), read_predictions(predictions_csv)
        h_S_d = read_embedding(embeddings_npz, registrations)["embedding"]
        require_same_samples(predictions_csv, predictions, registrations.arrays)
        for column in ("bald", *(f"variance_{concept}" for concept in CONCEPTS)):
            predictions[column] = numbers(predictions_csv, predictions, column)
        observed, u_clean = read_uncertainties(uncertainty_csv)
        u_S = observed.reindex(list(zip(predictions["split"], predictions["sample"], strict=True))).to_numpy(float)
        if np.isnan(u_S).all():
            raise InputError(uncertainty_csv, "its samples differ from those of the registrations", "regenerate both")
        return cls(registrations, h_S_d, predictions, u_S, u_clean, Limits(**limits))

    def choose(self, concept: str, path: str | Path, *others: str) -> int:
        """Row of the sample that is shown: a test sample of the concept whose registration is uncertain.

        It is named right, failed, more uncertain than 95 % of the clean pairs, and of median score. The `others` are
        tried next; then conditions are dropped one by one: that it failed, that it is uncertain (the half that ICP fits
        worst stays), that it is named right.
        """
        rows = self.predictions
        for other in (concept, *others):
            named = (rows["split"] == "test") & (rows["concept_true"] == other) & (rows["concept_predicted"] == other)
            uncertain = rows[named & (self.u_S > self.u_clean)]
            if len(failures := uncertain[[self.state(row) == FAILED for row in uncertain.index]]):
                return _median(failures, other)
        test = rows[(rows["split"] == "test") & (rows["concept_true"] == concept)]
        if test.empty:
            raise InputError(path, f"has no test sample of '{concept}'", "raise registrations.test")
        right = test[test["concept_predicted"] == concept]
        kept = test if right.empty else right
        uncertain = kept[self.u_S[kept.index] > self.u_clean]
        worst = kept.assign(fit=self.registrations.fitness[kept.index]).nsmallest((len(kept) + 1) // 2, "fit")
        return _median(uncertain if len(uncertain) else worst, concept)

    def error(self, row: int) -> float:
        """ADD-S of a row's pose after ICP in diameters; of clouds this sparse it is about 0.01 at best."""
        T_icp, T_true = (self.registrations.T_target_source(which, row) for which in ("icp", "true"))
        return adds_error(transform(inverse(T_true), self.registrations.target(row)), T_icp, T_true)

    def state(self, row: int) -> str:
        """State of a row after ICP, by its error alone."""
        if (error := self.error(row)) < self.limits.nominal:
            return NOMINAL
        return FAILED if error > self.limits.failed else BORDERLINE

    def clouds(self, row: int, which: str) -> tuple[np.ndarray, np.ndarray]:
        """Target and source (·, 3) of a row, the source at the pose ``init`` or ``icp``."""
        registrations = self.registrations
        moved = registrations.T_target_source(which, row) @ inverse(registrations.T_target_source("icp", row))
        return registrations.target(row), transform(moved, registrations.cloud(row))

    def seen(self, row: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Clouds before and after ICP in the axes of a wide view of the target, that in which the source moves most."""
        pairs = {which: self.clouds(row, which) for which in ("init", "icp")}
        target, source = pairs["icp"]
        moved = pairs["init"][1] - source
        view = max(widest_views(target), key=lambda view: float(np.linalg.norm(moved @ view[:2].T)))
        return {which: (target @ view.T, source @ view.T) for which, (target, source) in pairs.items()}

    def words(self, row: int, which: str) -> str:
        """Words on a pose: for ``init`` the perturbation, for ``icp`` the error and u."""
        if which == "init":
            return severity_text(self.registrations, row, str(self.registrations.concept[row]))
        uncertain = "" if np.isnan(self.u_S[row]) else f"\n$u$ = {self.u_S[row]:.1f} nats (clean: < {self.u_clean:.1f})"
        return f"{self.state(row)}, ADD-S {100 * self.error(row):.1f} % $d${uncertain}"


FILES = {
    "registrations": "registrations/{shown_source}/seed{first_seed}.npz",
    "embeddings": "embeddings/{shown_source}/{embedding}/seed{first_seed}.npz",
    "predictions": "predictions/{shown_source}/{gpca}/seed{first_seed}.csv",
    "uncertainties": "uncertainty/{shown_source}/causal/seed{first_seed}.csv",
}


def title_of_sample(run: Run, object_name: str) -> str:
    source = run.config["figures"]["source"]
    return f"{run.source_titles[source]}: {object_in_words(object_name, run.datasets[source])}"


def source_before_icp(registrations: Registrations, sample: int) -> np.ndarray:
    """Points (P, 3) of a sample in its initial pose, in the target's frame, relative to the diameter."""
    T_init_icp = registrations.T_target_source_init[sample] @ inverse(registrations.T_target_source_icp[sample])
    return transform(scale_translation(T_init_icp, 1 / registrations.diameter_m[sample]), registrations.cloud(sample))


def severity_text(registrations: Registrations, sample: int, concept: str) -> str:
    """A sample's severity as it is printed under its panel, with lengths relative to the diameter d."""
    if concept == "noise":
        return f"$\\sigma$ = {100 * registrations.severity_noise[sample]:.1f} % $d$"
    if concept == "pose":
        angle_deg = np.degrees(registrations.severity_rotation_rad[sample])
        return f"{angle_deg:.0f}° and {100 * registrations.severity_translation[sample]:.0f} % $d$"
    return f"{100 * registrations.severity_crop[sample]:.0f} % cut off"


def _median(rows: Frame, concept: str) -> int:
    ranked = rows.sort_values([f"score_{concept}", "sample"], kind="stable")
    return int(ranked.index[(len(ranked) - 1) // 2])


def draw_embedding(axes, h_d: np.ndarray) -> None:
    """Draw an embedding as a strip of cells, row by row; the darker, the larger the value within it."""
    columns = next(width for width in range(round(np.sqrt(len(h_d) / 2)) or 1, 0, -1) if len(h_d) % width == 0)
    axes.imshow(h_d.reshape(-1, columns), cmap=blues(), aspect="auto", interpolation="nearest")
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set(visible=True, linewidth=0.6, color=GRAY)


def draw_scores(axes, row: Series, numbered: bool = False) -> None:
    """Draw a sample's concept scores as bars ± one standard deviation, the numbers beside them if asked for."""
    scores = [row[f"score_{concept}"] for concept in CONCEPTS]
    deviations = [np.sqrt(row[f"variance_{concept}"]) for concept in CONCEPTS]
    draw_score_bars(axes, scores, row["concept_true"], deviations)
    axes.set(xlim=(0, 1))
    axes.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    for place, pair in enumerate(zip(scores, deviations, strict=True)) if numbered else ():
        axes.text(1.06, place, "{:.2f}±{:.2f}".format(*pair), ha="left", va="center", fontsize=SMALL_PT)


def draw_score_bars(
    axes, scores_C: Sequence[float], true_concept: str, deviations_C: Sequence[float] | None = None
) -> None:
    """Draw a bar for each concept from top to bottom, without axis at the left, the true concept's name in bold."""
    colors = [CONCEPT_COLORS[concept] for concept in CONCEPTS]
    axes.barh(range(len(CONCEPTS)), scores_C, 0.7, xerr=deviations_C, color=colors, error_kw={"lw": 0.8})
    for place, concept in enumerate(CONCEPTS):
        weight = "bold" if concept == true_concept else "normal"
        axes.text(-0.03, place, concept, ha="right", va="center", fontsize=SMALL_PT, fontweight=weight)
    axes.set(ylim=(len(CONCEPTS) - 0.4, -0.6), yticks=[])
    axes.spines["left"].set_visible(False)
