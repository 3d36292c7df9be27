"""The step ``reduce`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from gpca.io.arrays import save_arrays
from tests.steps.by_words import main

from .command_lines import arguments, arrays_changed, refused, removed, settings, untouched

FAULTS = [
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with Snakemake"),
    (arrays_changed("embeddings.npz", h=lambda h: h * np.nan), {}, r"array 'h' contains NaN"),
    (arrays_changed("embeddings.npz", h=np.ones_like), {}, r"training embeddings: are all identical"),
    (arrays_changed("embeddings.npz", split=lambda s: np.full_like(s, "test")), {}, r"has no training samples"),
    (
        untouched,
        settings("reduce", components=19),
        r"19 components are too many for 18 training embeddings of 32 numbers",
    ),
    (
        untouched,
        settings("reduce", neighbours=3),
        r"'autoencoder': has no setting 'neighbours'; its settings are components",
    ),
    (untouched, {"--reduction": "tsne"}, r"reduction 'tsne': unknown; choose one of none, pca"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "reduce", *FAULTS[fault])


def test_reduced_embeddings_are_of_the_same_samples_and_each_seed_has_its_own(folder):
    with np.load(folder / "embeddings.npz") as archive:
        save_arrays(folder / "seed1.npz", dict(archive) | {"seed": np.array(1)})
    given = {"--seeds": [0, 1], "--embeddings": ["embeddings.npz", "seed1.npz"], "--out": ["reduced.npz", "other.npz"]}
    assert main(arguments("reduce", given)) == 0
    whole, reduced, other = (np.load(folder / name) for name in ("embeddings.npz", "reduced.npz", "other.npz"))
    assert reduced["h"].shape == (24, 4)
    assert reduced["h"].dtype == np.float32
    for name in ("head_logits", "sample", "split"):
        assert np.array_equal(reduced[name], whole[name])
    assert not np.array_equal(other["h"], reduced["h"])


def test_unreduced_embeddings_are_those_that_were_given(folder):
    assert main(arguments("reduce", {"--reduction": "none", "--settings": {}})) == 0
    assert np.array_equal(np.load(folder / "reduced.npz")["h"], np.load(folder / "embeddings.npz")["h"])
