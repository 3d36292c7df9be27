import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.real_world.reliability import draw_frame_reliability
from gpca.pairs.perturbation import CONCEPTS


def predictions(folder, method, seed, confidence):
    named = np.array(CONCEPTS)[np.arange(30) % 3]
    true = np.where(np.arange(30) < 24, named, np.roll(named, 1))  # 80 % are right
    rows = {"sample": range(30), "split": "test", "object": "a", "concept_true": true, "concept_predicted": named}
    rows |= {f"score_{c}": np.where(named == c, confidence, (1 - confidence) / 2) for c in CONCEPTS}
    path = folder / f"predictions/real_rgbd/{method}/seed{seed}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows | {"abstained": False, "icp_calls": 0}).to_csv(path, index=False)
    return path


def test_a_panel_is_a_method_with_all_seeds_and_its_calibration_error(tmp_path):
    files = [predictions(tmp_path, "dgcnn-none", seed, 0.8) for seed in (0, 1)]
    files += [predictions(tmp_path, "gpca_pair", 0, 0.9)]
    figure = draw_frame_reliability(files, {"dgcnn-none": "DGCNN", "lost-none": "Lost", "gpca_pair": "Pair"}, "Frames")
    titles = [axes.get_title() for axes in figure.axes]
    assert [title for title in titles if title] == ["DGCNN\npooled ECE 0.000", "Pair\npooled ECE 0.100"]
    with pytest.raises(InputError, match="cover none of these methods"):
        draw_frame_reliability(files, {"lost-none": "Lost"}, "Frames")
