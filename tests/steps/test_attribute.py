"""The step ``attribute`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from baselines import analytical
from gpca.attribution.predictions import write_timings
from tests.steps.by_words import main

from .command_lines import arguments, arrays_changed, lines_kept, refused, removed, untouched, written

SHAP = {
    "--explainer": "shap_removal", "--settings": {}, "--embeddings": None, "--uncertainty": "uncertainty.npz",
    "--uncertainty-timings": "uncertainty_timings.csv", "--input-timings": "icp.csv",
}  # fmt: skip
FAULTS = [
    (removed("uncertainty.npz"), SHAP, r"uncertainty.npz: no such file; make it with Snakemake"),
    (arrays_changed("uncertainty.npz", sample=lambda s: s + 50), SHAP, r"its samples differ"),
    (arrays_changed("uncertainty.npz", residual=lambda r: r * np.nan), SHAP, r"array 'residual' contains NaN"),
    (removed("uncertainty_timings.csv"), SHAP, r"uncertainty_timings.csv: no such file"),
    (lines_kept("uncertainty_timings.csv", 20), SHAP, r"its samples differ"),
    (untouched, SHAP | {"--settings": {"worth": "rmse"}}, r"rmse"),
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with Snakemake"),
    (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"its samples differ from those of the registr"),
    (arrays_changed("embeddings.npz", h=lambda h: h[:, 0]), {}, r"array 'h' is 24, not S×d"),
    (arrays_changed("embeddings.npz", h=lambda h: h[1:]), {}, r"array 'head_logits' is 24×3, not 23"),
    (written("dgcnn.csv", "sample,seconds\n"), {}, r"dgcnn.csv: column 'split' is missing"),
    (untouched, {"--predictions": "meshes"}, r"meshes"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "attribute", *FAULTS[fault])


def test_an_explainer_measures_each_registration_once(registrations, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    registrations.save("registrations.npz")
    write_timings("icp.csv", registrations, *np.zeros((2, len(registrations))))
    measured, measure = [], analytical.analytical_features

    def counted(asked, *axes, **given):
        measured.extend(zip(asked.split, asked.sample, strict=True))
        return measure(asked, *axes, **given)

    monkeypatch.setattr(analytical, "analytical_features", counted)
    changes = {"--explainer": "analytical_gpc", "--embeddings": None, "--input-timings": "icp.csv"}
    assert main(arguments("attribute", changes)) == 0
    assert measured == list(zip(registrations.split, registrations.sample, strict=True))
