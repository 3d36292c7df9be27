import warnings

import numpy as np
import pytest
import torch

from gpca.encoders.reduction import REDUCTIONS, reduce
from gpca.errors import InputError

SMALL = {
    "none": {},
    "pca": {"components": 4},
    "umap": {"components": 4, "neighbours": 8},
    "autoencoder": {"components": 4, "epochs": 30},
}
AXES = ("tiny", 0)
every = pytest.mark.parametrize("name", SMALL)


def embeddings(n, d=24, seed=0):
    """Three clusters on a plane of 5 dimensions, with units that differ from number to number."""
    random = np.random.default_rng(seed)
    centers_3_5, plane_5_d = (np.random.default_rng(9).normal(size=shape) for shape in ((3, 5), (5, d)))
    codes_N_5 = 3 * centers_3_5[np.arange(n) % 3] + random.normal(size=(n, 5))
    return ((codes_N_5 @ plane_5_d + 0.1 * random.normal(size=(n, d))) * np.geomspace(0.1, 10, d)).astype(np.float32)


TRAIN, TEST = embeddings(45), embeddings(12, seed=1)


def test_every_reduction_is_tested():
    assert list(SMALL) == list(REDUCTIONS)


@every
def test_clusters_stay_apart(name):
    reduced_N_c = reduce(name, TRAIN, np.concatenate([TRAIN[:15], TEST]), SMALL[name], *AXES)
    assert reduced_N_c.dtype == np.float32
    assert reduced_N_c.shape == (27, SMALL[name].get("components", 24))
    nearest = np.linalg.norm(reduced_N_c[15:, None] - reduced_N_c[:15], axis=-1).argmin(axis=1)
    assert (nearest % 3 == np.arange(12) % 3).mean() > 0.9


@every
def test_a_repeat_is_the_same_to_the_bit_and_silent(name, capfd):
    with warnings.catch_warnings(action="error"):
        once, again = (reduce(name, TRAIN, TEST, SMALL[name], *AXES) for _ in range(2))
    assert np.array_equal(once, again)
    assert capfd.readouterr() == ("", "")


@every
def test_a_row_depends_on_no_other_row_that_is_reduced(name):
    others = np.concatenate([TEST[:3], 1e3 * TEST[3:]])
    reduced, beside_others = (reduce(name, TRAIN, h, SMALL[name], *AXES)[:3] for h in (TEST, others))
    assert np.array_equal(reduced, beside_others)
    alone = reduce(name, TRAIN, TEST[:1], SMALL[name], *AXES)
    np.testing.assert_allclose(alone, reduced[:1], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("name", ["pca", "umap", "autoencoder"])
def test_what_it_is_fitted_on_matters_and_its_units_do_not(name):
    def fitted_on(train):
        return reduce(name, train, TEST, SMALL[name], *AXES)

    assert np.abs(fitted_on(TRAIN) - fitted_on(TRAIN[:30])).max() > 1e-3
    units = (2.0 ** np.arange(-12, 12)).astype(np.float32)  # powers of two: no rounding
    in_other_units = reduce(name, TRAIN * units, TEST * units, SMALL[name], *AXES)
    np.testing.assert_allclose(in_other_units, fitted_on(TRAIN), rtol=1e-5, atol=1e-5)


def test_the_autoencoders_code_tells_nearly_as_much_as_pca_and_more_with_more_epochs():
    def unexplained(code_N_c):
        z_N_d = (TRAIN - TRAIN.mean(axis=0)) / TRAIN.std(axis=0)
        with_one = np.column_stack([code_N_c, np.ones(45)])
        residual = z_N_d - with_one @ np.linalg.lstsq(with_one, z_N_d, rcond=None)[0]
        return np.square(residual).mean()

    settings = {"components": 5}
    pca = unexplained(reduce("pca", TRAIN, TRAIN, settings, *AXES))
    short, long = (unexplained(reduce("autoencoder", TRAIN, TRAIN, settings | {"epochs": n}, *AXES)) for n in (1, 100))
    assert pca < long < 0.3 * short
    assert long < 0.1


@pytest.mark.parametrize("name", ["umap", "autoencoder"])
def test_random_numbers_are_named_by_the_axes_and_torchs_own_are_left_alone(name):
    torch.manual_seed(0)
    expected = torch.rand(3)
    torch.manual_seed(0)
    reduced = reduce(name, TRAIN, TEST, SMALL[name], *AXES)
    assert torch.equal(torch.rand(3), expected)
    assert not np.array_equal(reduce(name, TRAIN, TEST, SMALL[name], "tiny", 1), reduced)


def test_the_autoencoder_does_not_depend_on_the_number_of_threads():
    threads = torch.get_num_threads()
    try:
        results = []
        for number in (1, 2):
            torch.set_num_threads(number)
            results.append(reduce("autoencoder", TRAIN, TEST, SMALL["autoencoder"], *AXES))
            assert torch.get_num_threads() == number
    finally:
        torch.set_num_threads(threads)
    assert np.array_equal(*results)


@every
def test_numbers_that_are_constant_in_training_do_no_harm(name):
    train, test = TRAIN.copy(), TEST.copy()
    train[:, :3] = test[:, :3] = 0.7
    assert np.isfinite(reduce(name, train, test, SMALL[name], *AXES)).all()


FAULTS = [
    ("tsne", TRAIN, TEST, {}, "reduction 'tsne': unknown; choose one of none, pca, umap, autoencoder"),
    ("pca", TRAIN, TEST, {"epochs": 3}, "reduction 'pca': setting epochs: unknown; choose one of components"),
    ("none", TRAIN, TEST, {"components": 3}, "reduction 'none': setting components: unknown; leave it out"),
    ("pca", TRAIN, TEST, {"components": 25}, "25 components are too many for 45 training embeddings of 24 .* 24"),
    ("autoencoder", TRAIN[:9], TEST, {"components": 10}, "10 components are too many for 9 .*; .* at most 9"),
    ("umap", TRAIN[:12], TEST, {"components": 4}, "reduction 'umap': 15 neighbours are too many for 12 .*; lower n"),
    ("umap", TRAIN[:9], TEST, {"components": 7, "neighbours": 3}, "'umap': 7 components are too many for 9 training"),
    ("pca", np.ones_like(TRAIN), TEST, {"components": 4}, "training embeddings: are all identical"),
]


@pytest.mark.parametrize(("name", "train", "test", "settings", "message"), FAULTS)
def test_bad_inputs_are_one_line(name, train, test, settings, message):
    with pytest.raises(InputError, match=message) as caught:
        reduce(name, train, test, settings, *AXES)
    assert "\n" not in str(caught.value)
