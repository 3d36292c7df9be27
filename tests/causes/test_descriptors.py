from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.alignment.batched_icp import BatchedICP
from gpca.causes.descriptors import (
    COLUMNS,
    EVERYTHING,
    NOISE,
    OVERLAP,
    POSE,
    STARTS,
    WIDTHS,
    Descriptors,
    describe_all,
    describe_motion,
    describe_remedied,
    describe_starts,
    observed_pair,
    seen,
)
from gpca.causes.settings import GROUPS, MOTION, QUANTILES, REMEDIED, DescriptorSettings
from gpca.causes.truth import ALL
from gpca.errors import InputError
from gpca.rigid import inverse, scale_translation, transform
from tests.pairs.conftest import FEW, ICP


@pytest.fixture(scope="module")
def described(causes):
    return describe_all(causes, "four", 100, FEW, ICP)


def test_every_row_is_described_in_finite_numbers_by_neither_the_truth_nor_other_rows(causes, described):
    descriptors, seconds_S, icp_seconds_S = described
    assert set(descriptors.groups) == set(GROUPS)
    for group_S_F in descriptors.groups.values():
        assert len(group_S_F) == len(causes)
        assert np.isfinite(group_S_F).all()
    assert (seconds_S >= icp_seconds_S).all() and (icp_seconds_S > 0).all()
    some = causes.subset(np.array([3, 1]))
    hidden = replace(some, registrations=some.registrations.without_labels())
    again, _, _ = describe_all(hidden, "four", 100, FEW, ICP)
    for name in GROUPS:
        assert np.array_equal(again.groups[name], described[0].groups[name][[3, 1]])


def test_a_file_is_read_as_it_was_written_and_only_for_its_own_samples(causes, described, tmp_path):
    path = tmp_path / "descriptors.npz"
    described[0].save(path)
    read = Descriptors.load(path, causes.registrations)
    assert all(np.array_equal(read.groups[name], described[0].groups[name]) for name in GROUPS)
    with pytest.raises(InputError, match="its samples differ from those of the registrations"):
        Descriptors.load(path, causes.registrations.subset(np.arange(5)))


def test_a_pair_lies_where_icp_put_it_and_knows_the_way_back(causes):
    row = int(causes.rows("test")[0])
    seen, registrations = observed_pair(causes, row, "four"), causes.registrations
    assert np.array_equal(seen.model, registrations.target(row))
    assert seen.T_runs[0] == pytest.approx(np.eye(4), abs=1e-9)
    diameter_m = registrations.diameter_m[row]
    T_icp = scale_translation(registrations.T_target_source_icp[row], 1 / diameter_m)
    started = transform(inverse(T_icp), seen.observed)
    assert transform(seen.T_init, seen.observed) == pytest.approx(started, abs=1e-9)
    other = scale_translation(causes.T_target_source_runs[row, 3], 1 / diameter_m)
    assert transform(seen.T_runs[3], seen.observed) == pytest.approx(transform(other, started), abs=1e-9)


def motion(pair):
    return dict(zip(MOTION, describe_motion(pair), strict=True))


def starts(pair):
    return dict(zip(STARTS, describe_starts(pair, ICP), strict=True))


def turned(angle, shift=0.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([0, 0, angle]).as_matrix()
    T[0, 3] = shift
    return T


def test_icps_own_motion_and_the_spread_of_its_runs_are_told(pair):
    found = motion(replace(pair, T_init=inverse(turned(0.4))))
    assert found["rotation"] == pytest.approx(0.4)
    assert found["translation"] == pytest.approx(0, abs=1e-9)
    assert found["displacement"] > 0.05
    assert motion(pair)["displacement"] == 0
    angles = np.random.default_rng(0).normal(scale=0.2, size=13)
    found = motion(replace(pair, T_runs=np.array([turned(angle) for angle in angles])))
    assert found["spread_rotation"] == pytest.approx(angles.std(ddof=1))
    assert found["spread_translation"] == pytest.approx(0, abs=1e-9)
    assert found["log_determinant"] > motion(pair)["log_determinant"]


def test_a_better_result_from_another_start_is_told(pair):
    fitness_n, rmse_n = pair.fitness_n.copy(), pair.inlier_rmse_n.copy()
    runs = pair.T_runs.copy()
    runs[4], rmse_n[4] = turned(0.0, shift=0.3), 0.005
    found = starts(replace(pair, T_runs=runs, fitness_n=fitness_n, inlier_rmse_n=rmse_n))
    assert found["best_cost"] == pytest.approx(0.005**2)
    assert found["gain"] == pytest.approx(0.02**2 - 0.005**2)
    assert found["to_best"] == pytest.approx(0.3)
    assert starts(pair)["gain"] == 0


FIRST = np.cumsum([0, *(WIDTHS[group] for group in GROUPS)])
NUMBERED = {
    group: np.tile(np.arange(start, start + WIDTHS[group]), (2, 1)).astype(float)
    for group, start in zip(GROUPS, FIRST, strict=False)
}
ALL_PARTS = ("pair", "motion", "runs", "remedies")


def columns_shown(sees, group):
    """Return the columns of a group that these parts show."""
    return (seen({group: NUMBERED[group]}, sees, {group: slice(None)})[0] - NUMBERED[group][0, 0]).astype(int).tolist()


def test_all_parts_show_every_descriptor_in_order_and_the_source_alone_the_observed_cloud():
    assert seen(NUMBERED, ALL_PARTS)[0].tolist() == list(range(FIRST[-1]))
    assert seen(NUMBERED, ALL_PARTS[::-1]).shape == (2, sum(WIDTHS[group] for group in EVERYTHING))
    assert columns_shown(("source",), "distances") == list(range(3 * QUANTILES, 4 * QUANTILES))
    assert columns_shown(("source",), "planes") == [3 * QUANTILES + i for i in (0, 2, 4)]
    assert seen(NUMBERED, ("source",)).shape == (2, QUANTILES + 3)


def test_without_motion_nothing_says_how_far_a_cloud_was_moved_or_would_be():
    assert [MOTION[i] for i in columns_shown(("pair",), "motion")] == ["fitness", "inlier_rmse"]
    assert [MOTION[i] for i in columns_shown(("pair", "motion"), "motion")] == list(MOTION[:5])
    arrays = {group: array.copy() for group, array in NUMBERED.items()}
    for part in ("motion", "runs", "remedies"):
        for group, columns in COLUMNS[part].items():
            arrays[group][:, columns] = np.nan
    assert not np.isnan(seen(arrays, ("pair",))).any()
    assert np.isnan(seen(arrays, ("pair", "motion"))).sum() == 2 * 3


def test_quick_remedies_show_no_run_that_restarts_and_nothing_that_is_relative_to_one():
    shown = [REMEDIED[i] for i in columns_shown(("quick_remedies",), "remedied")]
    assert len(shown) == 3 * 4 + 2
    assert not any(name.startswith(("error", "phi")) for name in shown)
    assert {name.split("_")[1] for name in shown[:-2]} == {"2", "3", "6", "7"}  # subsets with the pose error left alone


def remedied(pair):
    return dict(zip(REMEDIED, describe_remedied(pair, FEW, ICP), strict=True))


def registered(pair, observed, T_init=None):
    """The pair as ICP leaves it: the model is aligned to what was observed."""
    T_start = np.eye(4) if T_init is None else T_init
    poses, fitness, rmse = BatchedICP(observed, ICP).register(pair.model, inverse(T_start)[None])
    T = inverse(poses[0])
    runs = np.tile(np.eye(4), (13, 1, 1))
    return replace(
        pair, observed=transform(T, observed), T_init=T_start @ inverse(T), T_runs=runs,
        fitness_n=np.full(13, fitness[0]), inlier_rmse_n=np.full(13, rmse[0]),
    )  # fmt: skip


def test_all_remedies_together_stand_for_the_truth_and_what_they_explain_adds_up(pair):
    found = remedied(pair)
    assert found["error_0"] == pytest.approx(0, abs=1e-9)
    phi = [found["phi_noise"], found["phi_pose"], found["phi_overlap"]]
    assert sum(phi) == pytest.approx(found[f"error_{ALL}"])


def test_missing_surface_a_bad_start_and_noise_are_what_their_remedies_mend(pair):
    half = pair.observed[pair.observed[:, 2] > np.quantile(pair.observed[:, 2], 0.4)]
    found = remedied(registered(pair, half))
    assert found[f"error_{1 << OVERLAP}"] > 0.04
    assert found["phi_overlap"] == max(found[f"phi_{name}"] for name in ("noise", "pose", "overlap"))
    T_init = np.eye(4)
    T_init[:3, :3] = Rotation.from_rotvec([0, 0, np.deg2rad(75)]).as_matrix()
    found = remedied(registered(pair, pair.observed, T_init))
    assert found[f"cost_{1 << POSE}"] >= found["cost_0"]
    assert found["moved_0"] > 0.05
    random = np.random.default_rng(0)
    noisy = pair.observed + random.normal(scale=0.03, size=pair.observed.shape)
    assert remedied(replace(pair, observed=noisy))["smoothed"] > remedied(pair)["smoothed"]
    assert NOISE == 0


def test_the_same_pair_has_the_same_numbers_and_another_sample_other_starts(pair):
    first, again = (describe_remedied(pair, FEW, ICP) for _ in range(2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, describe_remedied(replace(pair, axes=("other",)), FEW, ICP))


def test_the_remedies_run_as_often_as_their_settings_say(monkeypatch, pair):
    counted, settings, real = [], DescriptorSettings(starts=2, restarts=5, icp_points=64), BatchedICP.register

    def register(icp, moving, starts_n):
        counted.append(len(starts_n))
        return real(icp, moving, starts_n)

    monkeypatch.setattr(BatchedICP, "register", register)
    describe_remedied(pair, settings, ICP)
    assert sum(counted) == settings.remedy_calls
