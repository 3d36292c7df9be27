"""Intervals over clusters and seeds."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, interval, pigeonhole_weights, quantile_bounds, wilson_interval
from gpca.evaluation.measures import AGAINST, COLUMNS, SHARE, compared, intervals, read_clustered
from gpca.io.csv_file import write_csv
from gpca.seeds import generator

SEED = np.repeat([100, 101], 12)
CLUSTER = np.tile(["cup", "can", "drill"], 8)
RIGHT = np.where(CLUSTER == "cup", 0.0, 1.0)
KEYS = ("t", "ycb", "gpca", "accuracy", "all")


@pytest.fixture
def samples():
    return Clustered.drawn(SEED, CLUSTER, "tiny")


def test_a_share_has_the_interval_of_the_bootstrap_and_rows_keep_their_draws(samples):
    weights = pigeonhole_weights(generator("tiny"), SEED, CLUSTER)
    assert (samples.weights[1:] == weights).all() and (samples.weights[0] == 1).all()
    with np.errstate(invalid="ignore"):
        drawn = (weights * RIGHT).sum(axis=1) / weights.sum(axis=1)
    assert samples.share(RIGHT) == interval(np.append((RIGHT * 1.0).mean(), drawn), weights)
    of_cans = samples.subset(CLUSTER == "can")
    assert (of_cans.weights == samples.weights[:, CLUSTER == "can"]).all() and len(of_cans) == 8


def test_a_share_is_as_wide_as_its_clusters_make_it_or_wilsons(samples):
    alike = Clustered.drawn(np.zeros(6), np.repeat(["cup", "can"], 3), "tiny")
    right = np.array([1, 0, 0, 0, 1, 1])
    assert quantile_bounds((alike.weights[1:] * right).sum(axis=1) / 6) == pytest.approx((1 / 3, 2 / 3))
    assert alike.share(right) == (0.5, *wilson_interval(3, 6))
    apart = Clustered.drawn(np.zeros(24), np.arange(24), "tiny")
    width = {name: np.ptp(of.share(RIGHT)[1:]) for name, of in (("clusters", samples), ("apart", apart))}
    assert width["clusters"] > 1.5 * width["apart"] > 0
    assert samples.share(np.ones(24)) == (1, *wilson_interval(6, 6))
    assert samples.subset(CLUSTER == "can").share(np.zeros(8)) == (0, *wilson_interval(0, 2))


def test_an_instance_with_several_starts_counts_once_in_a_share_and_in_its_interval():
    right, starts = np.array([1, 0, 0, 0, 1, 1]), np.arange(1, 7)
    alike = Clustered.drawn(np.zeros(6), np.repeat(["cup", "can"], 3), "tiny")
    several = replace(alike.subset(np.repeat(np.arange(6), starts)), instance=np.repeat(np.arange(6), starts))
    assert several.share(np.repeat(right, starts)) == pytest.approx(alike.share(right))
    for samples in (alike, several):
        values = {"rule": np.append(0.5, np.tile([0.4, 0.6], 250))}
        [row] = compared(("t", "ycb"), "accuracy", "all", values, samples, SHARE)
        assert row[-2:] == wilson_interval(3, 6)
    assert several.subset(slice(1, None)).independent == 5


def test_a_difference_is_paired_a_mean_has_limits_and_one_cluster_says_nothing(samples):
    other = np.where(CLUSTER == "can", 0.0, RIGHT)
    value, low, high = samples.difference(RIGHT, other)
    assert (value, low) == (pytest.approx(1 / 3), 0) and value < high <= 1
    assert samples.difference(RIGHT, RIGHT) == (0, *[sign * wilson_interval(0, 6)[1] for sign in (-1, 1)])
    value = np.where(CLUSTER == "cup", 3.0, -1.0)
    mean, low, high = samples.mean(value, (-0.5, np.inf))
    assert (mean, low) == (pytest.approx(1 / 3), -0.5) and high > mean
    assert samples.mean(value).low == -1
    alone = Clustered.drawn(np.zeros(5), ["cup"] * 5, "tiny")
    assert np.isnan(alone.mean(np.arange(5.0))[1:]).all()
    assert alone.share(np.ones(5)) == (1, *wilson_interval(1, 1))  # a share has an interval nevertheless


def test_a_measure_of_each_seed_is_averaged_by_their_samples_and_its_draws_lie_about_it(samples):
    mean = samples.mean(RIGHT)

    def inflated(rows, weights):
        value_B = (weights * RIGHT[rows]).sum(axis=1) / np.maximum(weights.sum(axis=1), 1)
        return np.append(value_B[0], value_B[1:] + 0.25)  # as if resampling made it larger

    of_seeds = samples.over_seeds(inflated, (0, 1))
    assert of_seeds.value == pytest.approx(mean.value)
    assert 0 <= of_seeds.low < of_seeds.value < of_seeds.high <= 1
    uneven = Clustered.drawn(np.append(SEED, [101] * 12), np.append(CLUSTER, CLUSTER[:12]), "tiny")
    by_seed = {100: 0.2, 101: 0.8}
    told = uneven.over_seeds(lambda rows, weights: np.full(len(weights), by_seed[uneven.seed[rows[0]]]))
    assert told.value == pytest.approx((12 * 0.2 + 24 * 0.8) / 36)


def test_rows_are_written_and_read_back_or_refused(samples, tmp_path):
    records = [samples.record(KEYS, samples.share(RIGHT))]
    lonely = Clustered.drawn([0, 0], ["cup", "cup"], "tiny")
    records.append(lonely.record(KEYS, lonely.mean([1.0, 2.0])))
    write_csv(tmp_path / "intervals.csv", intervals(records, "tiny"), form=None)
    read = read_clustered(tmp_path / "intervals.csv")
    assert list(read.columns) == [*COLUMNS, *AGAINST]
    assert read.loc[0, ["seeds", "clusters", "samples"]].tolist() == [2, 3, 24]
    assert read.loc[0, ["value", "low", "high"]].tolist() == list(records[0][-3:])
    assert read.loc[1, "value"] == 1.5 and read.loc[1, ["low", "high"]].isna().all()
    with pytest.raises(InputError, match="tiny: no files were given"):
        intervals([], "tiny")
    rows = intervals([samples.record(KEYS, samples.share(RIGHT))], "tiny")
    write_csv(tmp_path / "intervals.csv", rows.assign(samples="many"), form=None)
    with pytest.raises(InputError, match="'samples' contains values that are not finite numbers"):
        read_clustered(tmp_path / "intervals.csv")
