"""What is measured beside what was promised: coverage and size of sets, and the two risks of the alarm."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.causes.truth import NOMINAL
from gpca.errors import InputError
from gpca.evaluation.intervals import interval, pigeonhole_weights
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.guarantee.answers import BY_FAMILY, FAMILIES, Answers, answers_of, conditions
from gpca.experiments.guarantee.experiment import promises
from gpca.experiments.guarantee.scored import Scored
from gpca.experiments.guarantee.settings import GuaranteeSettings
from gpca.guarantee.conformal import ALARM, GOOD, NOT_SURE
from gpca.guarantee.guarantee import STATES
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator
from gpca.settings import read_settings

if TYPE_CHECKING:
    import pandas as pd

TABLE = "guarantee"
COLUMNS = (
    *("table", "condition", "source", "method", "variant", "metric", "concept", "promised"),
    *("families", "samples", "clusters", "seeds", "value", "low", "high"),
)
NUMBERS = COLUMNS[7:]
COVERAGE, SIZE, SINGLE = OF_SETS = ("coverage", "set_size", "single_state")
MISSED, FALSE_ALARMS, UNSURE = OF_ALARM = ("missed_failures", "false_alarms", "not_sure")
SHARES = (COVERAGE, SINGLE, *OF_ALARM)
Measure = tuple[str, str, str, float, np.ndarray, np.ndarray]  # variant, metric, concept, promised, value_A, counted_A


def collect(score_files: Iterable[str | Path], section: Mapping[str, Any]) -> pd.DataFrame:
    """Return values with 95 % intervals of a bootstrap over families and seeds.

    Args:
        score_files: named ``…/{explainer}.csv``.
        section: the config's section ``guarantee``.

    Raises:
        InputError: no files, a file that cannot be read.
    """
    import pandas as pd

    settings = read_settings(GuaranteeSettings, promises(section))
    rows: list[tuple] = []
    for path in score_files:
        scored = Scored.load(path)
        for condition in conditions(scored):
            answers = answers_of(scored, condition, settings)
            if answers is not None:
                asked = scored.subset(answers.row)
                rows += _of_condition(condition.name, Path(path).stem, asked, answers, settings)
    if not rows:
        raise InputError("guarantee", "no files with scores were given", "name an explainer in guarantee.explainers")
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_guarantee(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect` returned; what is no share of errors has no promise, and a value may lack an interval.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, NUMBERS, optional=("promised", "low", "high"))


def _of_condition(
    name: str, explainer: str, asked: Scored, answers: Answers, settings: GuaranteeSettings
) -> Iterator[tuple]:
    # All samples of a family and a seed are drawn together, so that sums over them are enough.
    keys_A = np.char.add(np.char.add(asked.seed.astype(str), " "), asked.family)
    _, first_C, group_A = np.unique(keys_A, return_index=True, return_inverse=True)
    random = generator("guarantee intervals", name)
    drawn_B_C = pigeonhole_weights(random, asked.seed[first_C], asked.family[first_C])
    sources = list(dict.fromkeys(asked.source.tolist()))
    places = {source: asked.source == source for source in sources}
    if len(sources) > 1:
        places = {POOLED: np.ones(len(asked), bool)} | places
    measures = list(_measures(asked, answers, settings))
    for place, inside_A in places.items():
        by_state = name == FAMILIES and place == next(iter(places))
        for variant, metric, concept, promised, value_A, counted_A in measures:
            of_A = inside_A & counted_A
            if not of_A.any() or (concept != ALL and not by_state):
                continue
            weight_C = np.bincount(group_A[of_A], asked.weight[of_A], len(first_C))
            sum_C = np.bincount(group_A[of_A], asked.weight[of_A] * value_A[of_A], len(first_C))
            with np.errstate(invalid="ignore"):
                values_B = (drawn_B_C * sum_C).sum(axis=1) / (drawn_B_C * weight_C).sum(axis=1)
            value_B = np.append(float(sum_C.sum() / weight_C.sum()), values_B)
            samples, drawn_B_c = _different(asked, of_A), drawn_B_C[:, weight_C > 0] if metric in SHARES else None
            counts = (len(set(column[of_A].tolist())) for column in (asked.family, asked.seed))
            yield (
                *(TABLE, name, place, explainer, variant, metric, concept, promised, answers.families),
                *(samples, *counts, *interval(value_B, drawn_B_c, samples=samples)),
            )


def _different(asked: Scored, of_A: np.ndarray) -> int:
    """Return how many samples there are, each of which may have been asked about several times."""
    return len(set(zip(asked.source[of_A], asked.seed[of_A], asked.sample[of_A], strict=True)))


def _measures(asked: Scored, answers: Answers, settings: GuaranteeSettings) -> Iterator[Measure]:
    """Yield every measure of every variant.

    - coverage: share of the sets that hold the true state, of all samples and of those of each state;
    - set_size: mean number of states in a set; single_state: share of the sets of one state alone;
    - missed_failures: share of the failed that are called good; false_alarms: of the nominal that are called failed;
    - not_sure: share that is called neither.
    """
    everything_A, nominal_A = np.ones(len(asked), bool), asked.state == NOMINAL
    true_A_5 = asked.state[:, None] == np.array(STATES)
    for variant, inside_A_5 in answers.sets.items():
        holds_A, size_A = (inside_A_5 & true_A_5).any(axis=1).astype(float), inside_A_5.sum(axis=1).astype(float)
        of_states = {ALL: everything_A} | dict(zip(STATES, true_A_5.T, strict=True))
        for concept, counted_A in of_states.items():
            yield variant, COVERAGE, concept, settings.level, holds_A, counted_A
            yield variant, SIZE, concept, np.nan, size_A, counted_A
        yield variant, SINGLE, ALL, np.nan, (size_A == 1).astype(float), everything_A
    for variant, called_A in answers.calls.items():
        missed, false_alarms = (
            (settings.family_risk,) * 2 if variant == BY_FAMILY else (settings.missed, settings.false_alarms)
        )
        yield variant, MISSED, ALL, missed, (called_A == GOOD).astype(float), ~nominal_A
        yield variant, FALSE_ALARMS, ALL, false_alarms, (called_A == ALARM).astype(float), nominal_A
        yield variant, UNSURE, ALL, np.nan, (called_A == NOT_SURE).astype(float), everything_A
