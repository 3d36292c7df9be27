from dataclasses import replace

import numpy as np
import pytest

from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import transform
from gpca.uncertainty import designs
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, UPPER, PairDraws
from gpca.uncertainty.settings import CONDITIONS, CORNERS, LATIN, SALTELLI, UncertaintySettings

SETTINGS = UncertaintySettings(starts=13, icp_points=60)
XI = np.random.default_rng(0).normal(size=(13, 6)) * SETTINGS.deviation_6()


def draws(settings, seed):
    return PairDraws(XI, settings, np.random.default_rng(seed))


def outcomes(design, registrations, row, settings=SETTINGS):
    return designs.DESIGNS[design].evaluate(designs.RegisteredRow(registrations, row), draws(settings, row))


def numbers(made):
    return [(each.covariance.tobytes(), each.residual, each.degenerate, each.icp_calls) for each in made]


@pytest.fixture(scope="module")
def evaluated(registrations):
    """Outcomes of every design for one test sample of each concept."""
    rows = [np.flatnonzero((registrations.split == "test") & (registrations.concept == c))[0] for c in CONCEPTS]
    return {design: {int(row): outcomes(design, registrations, row) for row in rows} for design in designs.DESIGNS}


def test_the_names_of_the_corners_are_what_is_switched_on():
    knobs = ("untouched", "noise", "pose", "noise+pose", "overlap", "noise+overlap", "pose+overlap")
    knobs += ("noise+pose+overlap",)
    assert CONDITIONS["oracle"] == CONDITIONS["additive"][:8] == knobs
    assert CONDITIONS["additive"][8:] == ("noise_step", "pose_step", "overlap_step")
    assert CONDITIONS["removal"] == (
        *("observed", "denoise", "restart", "denoise+restart", "trim", "denoise+trim", "restart+trim"),
        "denoise+restart+trim",
    )
    assert CONDITIONS["removal"][designs.DESIGNS["removal"].reference] == "denoise+restart+trim"
    assert CONDITIONS["causal"] == ("reference", "clean", "observed")
    assert len(CONDITIONS["latin"]) == 1 + LATIN
    assert len(CONDITIONS["saltelli"]) == 1 + 5 * SALTELLI


def test_the_settings_of_the_knobs_are_in_the_order_of_the_names(registrations, monkeypatch):
    from gpca.uncertainty import designs

    asked = []

    class Recorded(designs.KnobRuns):
        def __call__(self, knobs):
            asked.append(knobs)
            return super().__call__(knobs)

    monkeypatch.setattr(designs, "KnobRuns", Recorded)
    outcomes("additive", registrations, 40)
    for knobs, name in zip(asked[:8], CONDITIONS["additive"][:8], strict=True):
        expected = [
            middle if concept in name.split("+") else rest
            for concept, middle, rest in zip(CONCEPTS, MIDDLE, UNTOUCHED, strict=True)
        ]
        assert knobs == tuple(expected)
    for i, knobs in enumerate(asked[8:]):
        step = np.array(knobs) - UNTOUCHED
        assert step[i] == pytest.approx(0.1 * designs.KNOB_RANGE[i]) and np.count_nonzero(step) == 1
    assert designs.STEP == 0.1 and np.allclose(designs.KNOB_RANGE, [0.03, 5.0, 0.6])
    asked.clear()
    outcomes("latin", registrations, 40)
    assert asked[0] == UNTOUCHED and np.array_equal(asked[1:], designs.sample_knobs("latin"))


def test_icp_runs_once_for_every_setting_that_differs(evaluated):
    runs = {"additive": 11, "latin": 25, "saltelli": 41, "oracle": 2, "removal": 8, "observed": 1, "causal": 3}
    for design, of_row in evaluated.items():
        for made in of_row.values():
            # Saltelli's scheme may hold a setting twice.
            distinct = len({each.covariance.tobytes() for each in made}) if design == "saltelli" else runs[design]
            assert sum(each.icp_calls for each in made) == 13 * distinct
            assert distinct > 0.8 * runs[design]


@pytest.mark.parametrize("concept", CONCEPTS)
def test_the_oracles_corners_are_two_settings(registrations, evaluated, concept):
    (made,) = [made for row, made in evaluated["oracle"].items() if registrations.concept[row] == concept]
    on = [corner[CONCEPTS.index(concept)] for corner in CORNERS]
    touched, at_rest = ({made[k].covariance.tobytes() for k in range(8) if on[k] == is_on} for is_on in (True, False))
    assert len(touched) == len(at_rest) == 1 and touched != at_rest
    assert [each.icp_calls for each in made if each.icp_calls] == [13, 13]


def test_observed_and_clean_pairs_are_the_same_in_every_design_and_clean_ones_differ(registrations, evaluated):
    for row in evaluated["additive"]:
        observed = evaluated["additive"][row][0]
        assert not observed.degenerate
        for design, condition in (("latin", 0), ("saltelli", 0), ("causal", 2), ("removal", 0), ("observed", 0)):
            assert np.array_equal(evaluated[design][row][condition].covariance, observed.covariance)
        for design in ("latin", "saltelli"):
            assert evaluated[design][row][0].residual == observed.residual
    for row, (reference, clean, observed) in evaluated["causal"].items():
        assert np.array_equal(reference.covariance, evaluated["oracle"][row][0].covariance)
        assert not np.array_equal(reference.covariance, clean.covariance)
        assert not np.array_equal(reference.covariance, observed.covariance)


@pytest.mark.parametrize(
    ("noise", "rotation_deg", "translation", "crop", "expected"),
    [
        (0.02, 0.0, 0.0, 0.0, (0.02, 1.0, 0.0)),
        (0.0, 30.0, 0.05, 0.0, (0.0, 3.0, 0.0)),
        (0.0, 30.0, 0.25, 0.0, (0.0, 5.0, 0.0)),
        (0.0, 5.0, 0.01, 0.0, (0.0, 1.0, 0.0)),
        (0.0, 0.0, 0.0, 0.45, (0.0, 1.0, 0.45)),
        (0.0, 0.0, 0.0, 0.0, (0.0, 1.0, 0.0)),
    ],
)
def test_the_true_knobs_are_the_severities(registrations, noise, rotation_deg, translation, crop, expected):
    one = replace(
        registrations.subset(np.array([0])),
        severity_noise=np.array([noise]),
        severity_rotation_rad=np.deg2rad([rotation_deg]),
        severity_translation=np.array([translation]),
        severity_crop=np.array([crop]),
    )
    assert designs.RegisteredRow(one, 0).true_knobs(SETTINGS) == pytest.approx(expected)
    wider = UncertaintySettings(start_rotation_deg=20.0, start_translation=0.1)
    assert designs.RegisteredRow(one, 0).true_knobs(wider).spread == pytest.approx(max(1.0, expected[1] / 2))


def test_a_pair_is_the_source_in_its_own_frame(registrations):
    for row in range(0, len(registrations), 7):
        pair = designs.RegisteredRow(registrations, row)
        assert np.allclose(transform(pair.T_icp, pair.source), registrations.cloud(row), atol=1e-6)
        assert np.array_equal(pair.target, registrations.target(row))
        translation_m = registrations.T_target_source_icp[row][:3, 3]
        assert np.allclose(pair.T_icp[:3, 3], translation_m / registrations.diameter_m[row])


def test_observed_and_clean_pairs_hold_as_many_points_as_asked_for(registrations):
    pair = designs.RegisteredRow(registrations, 40)
    source, target, T_init, T_ref = pair.observed(60, np.random.default_rng(0))
    assert len(source) == len(target) == 60
    assert len(np.unique(source, axis=0)) == 60 and np.isin(source, pair.source).all()
    assert T_init is pair.T_init and T_ref is pair.T_icp
    many = pair.observed(10_000, np.random.default_rng(0))
    assert len(many[0]) == len(pair.source) and len(many[1]) == len(pair.target)
    for points, expected in ((60, 60), (10_000, len(pair.target) // 3)):
        first, second = pair.clean(points, 1), pair.clean(points, 2)
        clouds = [first[0], second[0], first[1]]
        assert [len(cloud) for cloud in clouds] == [expected] * 3
        # No point is in two of the clouds, nor twice in one.
        assert len(np.unique(np.concatenate(clouds), axis=0)) == 3 * expected
        assert np.array_equal(first[1], second[1])
        assert np.array_equal(first[2], np.eye(4)) and np.array_equal(first[3], np.eye(4))


@pytest.mark.parametrize(("kind", "settings"), [("latin", LATIN), ("saltelli", 5 * SALTELLI)])
def test_sampled_knobs_lie_within_the_ranges(kind, settings):
    sampled = designs.sample_knobs(kind)
    assert sampled.shape == (settings, 3)
    assert (sampled >= UNTOUCHED).all() and (sampled <= UPPER).all()
    assert (np.ptp(sampled, axis=0) > 0.8 * designs.KNOB_RANGE).all()
    designs.sample_knobs.cache_clear()
    assert np.array_equal(designs.sample_knobs(kind), sampled)
