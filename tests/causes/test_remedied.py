from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gpca.causes.descriptors as module
from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.rigid import inverse, transform
from gpca.causes.descriptors import NOISE, OVERLAP, POSE, describe_remedied
from gpca.causes.settings import REMEDIED, DescriptorSettings
from gpca.causes.truth import ALL
from tests.pairs.conftest import FEW, ICP


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


def test_missing_surface_is_what_aligning_the_other_way_mends(pair):
    half = pair.observed[pair.observed[:, 2] > np.quantile(pair.observed[:, 2], 0.6)]
    found = remedied(registered(pair, half))
    assert found[f"error_{1 << OVERLAP}"] > 0.05
    assert found["phi_overlap"] == max(found[f"phi_{name}"] for name in ("noise", "pose", "overlap"))


def test_a_bad_start_is_what_restarts_mend(pair):
    T_init = np.eye(4)
    T_init[:3, :3] = Rotation.from_rotvec([0, np.deg2rad(75), 0]).as_matrix()
    found = remedied(registered(pair, pair.observed, T_init))
    assert found[f"cost_{1 << POSE}"] >= found["cost_0"]
    assert found["moved_0"] > 0.05


def test_outliers_are_counted_and_smoothing_measured(pair):
    random = np.random.default_rng(0)
    noisy = pair.observed + random.normal(scale=0.03, size=pair.observed.shape)
    assert remedied(replace(pair, observed=noisy))["smoothed"] > remedied(pair)["smoothed"]
    assert NOISE == 0


def test_the_same_pair_has_the_same_numbers_and_another_sample_other_starts(pair):
    first, again = (describe_remedied(pair, FEW, ICP) for _ in range(2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, describe_remedied(replace(pair, axes=("other",)), FEW, ICP))


def test_the_remedies_run_as_often_as_their_settings_say(monkeypatch, pair):
    counted, settings = [], DescriptorSettings(starts=2, restarts=5, icp_points=64)

    def register(observed, model, starts_n, onto_observed, icp):
        counted.append(len(starts_n))
        return real(observed, model, starts_n, onto_observed, icp)

    real = module._register
    monkeypatch.setattr(module, "_register", register)
    describe_remedied(pair, settings, ICP)
    assert sum(counted) == settings.remedy_calls
