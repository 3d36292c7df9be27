import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.real_world import reliability as frame_reliability
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


def test_a_panel_is_a_method_with_all_seeds_and_its_calibration_error(tmp_path, monkeypatch):
    titles = []
    finish = frame_reliability.finish_panels
    monkeypatch.setattr(
        frame_reliability,
        "finish_panels",
        lambda figure, *rest: (titles.extend(axes.get_title() for axes in figure.axes), finish(figure, *rest)),
    )
    files = [predictions(tmp_path, "dgcnn-none", seed, 0.8) for seed in (0, 1)]
    files += [predictions(tmp_path, "gpca_pair", 0, 0.9)]
    methods = {"dgcnn-none": "DGCNN", "lost-none": "Lost", "gpca_pair": "Pair"}
    out = tmp_path / "out.pdf", tmp_path / "out.png"
    frame_reliability.draw_frame_reliability(files, methods, "Frames", *out)
    assert [title for title in titles if title] == ["DGCNN\npooled ECE 0.000", "Pair\npooled ECE 0.100"]
    assert all(path.stat().st_size > 0 for path in out)
    with pytest.raises(InputError, match="cover none of these methods"):
        frame_reliability.draw_frame_reliability(files, {"lost-none": "Lost"}, "Frames", *out)
