"""Intervals over objects and seeds, from predictions of single samples."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.attribution.confidence import wilson_interval
from gpca.attribution.predictions import PREDICTION_COLUMNS
from gpca.comparison.clusters import cluster_draws, folder_behind, folders_behind
from gpca.comparison.values import value_of_run
from gpca.errors import InputError

from .conftest import write
from .made_up import ACCURACY, LABELS, number, tidy

CONCEPTS = ("noise", "pose", "overlap")
TAKEN = replace(ACCURACY, metrics=("predicted_as_pose", "test_samples"), concept="overlap")


def predictions(folder, right_of_object, seeds=5, sets=(), method="gpca_paper"):
    """Write, of every object, 20 samples of overlap in each seed, a share of them right and the rest called pose.

    Of sets, the first is like this; in the others nothing is right.
    """
    heads = (*PREDICTION_COLUMNS, *(f"score_{concept}" for concept in CONCEPTS), *(("set",) if sets else ()))
    rows = []
    for name_of_set in sets or (None,):
        for name, right in right_of_object.items():
            for i in range(20):
                named = "overlap" if i < 20 * right and name_of_set in (None, *sets[:1]) else "pose"
                scores = (float(named == concept) for concept in CONCEPTS)
                own_set = (name_of_set,) if sets else ()
                about = (len(rows), "test", name, name.split("_")[0], "overlap", named, False, 0)
                rows.append((*about, *scores, *own_set))
    of_explainer = folder / ("learners" if sets else "predictions") / "ycb" / method
    paths = [of_explainer / f"seed{seed}.csv" for seed in range(100, 100 + seeds)]
    for path in paths:
        write(path, heads, rows)
    return paths


def bounds_of(counterpart, files):
    """Return the bounds of a share over clusters and seeds."""
    return cluster_draws([counterpart], files)[counterpart].bounds()


def test_objects_that_differ_make_the_interval_wide(tmp_path):
    alike = predictions(tmp_path / "alike", dict.fromkeys("abcdef", 0.75))
    apart = predictions(tmp_path / "apart", dict(zip("abcdef", (1, 1, 1, 0.5, 0.5, 0.5), strict=True)))
    low, high = bounds_of(ACCURACY, alike)
    # No object and no seed is unlike the others, so that six objects in five seeds count.
    assert (low, high) == pytest.approx(wilson_interval(0.75 * 30, 30))
    low, high = bounds_of(ACCURACY, apart)
    assert 0.5 <= low < 0.6
    assert 0.9 < high <= 1.0
    found = value_of_run(number(), {"metrics.csv": tidy([0.75] * 5)}, cluster_draws([ACCURACY], apart))
    assert (found.low, found.high) == (75, 75)  # though no seed differs
    assert found.interval() == (pytest.approx(100 * low), pytest.approx(100 * high))


def test_confusions_are_shares_too(tmp_path):
    files = predictions(tmp_path, dict.fromkeys("abc", 0.75))
    assert bounds_of(TAKEN, files) == pytest.approx(wilson_interval(3.75, 15))
    other = replace(TAKEN, concept="noise")  # of which there is no sample
    assert np.isnan(bounds_of(other, files)).all()


def test_of_learners_the_set_that_is_named_counts(tmp_path):
    files = predictions(tmp_path, {"a": 1.0, "b": 0.5}, sets=("in_distribution", "severity"))
    within = replace(ACCURACY, file="diagnostics.csv", table="learners/in_distribution")
    beyond = replace(within, table="learners/severity")
    found = cluster_draws([within, beyond], files)
    assert found[within].bounds() == (0.5, 1.0)
    assert found[beyond].bounds() == wilson_interval(0, 10)


def test_views_of_one_instance_are_one_object(tmp_path):
    files = predictions(tmp_path, {"cup_1_1": 1.0, "cup_1_2": 0.0})
    assert bounds_of(ACCURACY, files) == pytest.approx(wilson_interval(2.5, 5))


def test_what_is_no_share_of_samples_has_none(tmp_path):
    deviation = replace(ACCURACY, statistic="deviation")
    assert [folder_behind(c) for c in (None, LABELS, deviation, replace(ACCURACY, metrics=("ece",)))] == [None] * 4
    assert folders_behind([ACCURACY, TAKEN, LABELS, None]) == [("predictions", "ycb", "gpca_paper")]
    assert cluster_draws([ACCURACY, LABELS, None], []) == {}


def test_a_file_that_is_none_is_refused(tmp_path):
    [path] = predictions(tmp_path, {"a": 1.0}, seeds=1)
    path.write_text("sample,split\n0,test\n")
    with pytest.raises(InputError, match=r"seed100\.csv"):
        cluster_draws([ACCURACY], [path])


def test_differences_are_of_the_same_draws(tmp_path):
    right = dict(zip("abcdef", (1, 1, 0.75, 0.5, 0.25, 0.25), strict=True))
    ours = predictions(tmp_path, right)
    theirs = predictions(tmp_path, {name: share - 0.25 for name, share in right.items()}, method="other")
    other = replace(ACCURACY, methods=("other",))
    drawn = cluster_draws([ACCURACY, other], [*ours, *theirs])
    low, high = drawn[ACCURACY].bounds()
    assert high - low > 0.4  # objects differ
    # All objects have the same difference, so that its interval is that of a share in six objects and five seeds.
    assert drawn[ACCURACY].bounds_of_difference(drawn[other]) == pytest.approx(wilson_interval(7.5, 30))
