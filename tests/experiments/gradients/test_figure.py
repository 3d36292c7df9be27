import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.gradients.figure import draw_saliency
from gpca.experiments.gradients.metrics import DELETION_COLUMNS
from gpca.io.arrays import save_arrays
from gpca.pairs.perturbation import CONCEPTS


@pytest.fixture
def files(registrations, tmp_path):
    """Maps of two test samples of each concept, of which the second is named right; of noise neither is."""
    test = registrations.rows("test")
    rows = np.concatenate([test[registrations.concept[test] == concept][:2] for concept in CONCEPTS])
    random = np.random.default_rng(0)
    maps = {"points": random.normal(size=(6, 30, 3)), "saliency": random.uniform(size=(6, 30))}
    save_arrays(tmp_path / "maps.npz", {"sample": registrations.sample[rows], **maps})
    records = []
    for place, row in enumerate(rows):
        true = registrations.concept[row]
        named = true if place % 2 and true != "noise" else CONCEPTS[(CONCEPTS.index(true) + 1) % 3]
        records.append((registrations.sample[row], true, named, "gradient", 0.25, 0.9 - place / 100, 0.5, 0))
    pd.DataFrame(records, columns=list(DELETION_COLUMNS)).to_csv(tmp_path / "rows.csv", index=False)
    registrations.save(tmp_path / "registrations.npz")
    return [tmp_path / name for name in ("registrations.npz", "maps.npz", "rows.csv")]


def test_one_sample_of_each_concept_is_drawn_named_right_where_there_is_one(files):
    titles = [axes.get_title() for axes in draw_saliency(*files, "Tiny").axes]
    assert titles[:3] == ["noise: named pose, 0.89", "pose: named pose, 0.87", "overlap: named overlap, 0.85"]


def test_maps_of_other_samples_are_refused(files):
    rows = pd.read_csv(files[2])
    rows.assign(sample=rows["sample"] + 1000).to_csv(files[2], index=False)
    with pytest.raises(InputError, match="its samples differ from"):
        draw_saliency(*files, "Tiny")
