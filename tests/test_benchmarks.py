import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import floor, pipeline
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.outcomes import Outcomes
from gpca.uncertainty.settings import CONDITIONS

ROOT = Path(__file__).resolve().parents[1]


def last_line(text):
    return json.loads(text.splitlines()[-1])


def test_edge_conv_compares_networks_of_equal_embeddings_and_notices_unequal_ones():
    import torch

    from benchmarks.edge_conv import make_networks, max_abs_error

    torch.manual_seed(0)
    clouds = torch.randn(2, 40, 3)
    reference, fused = make_networks(5, clouds)
    assert reference.edge_convs[0] is not fused.edge_convs[0]
    assert max_abs_error(reference, fused, clouds) < 1e-5
    reference.edge_convs[1].linear.weight.data.mul_(1.1)
    assert max_abs_error(reference, fused, clouds) > 1e-3


def test_backbones_ends_with_the_numbers_of_each(capsys):
    from benchmarks import backbones

    backbones.main(["--batch", "2", "--points", "40", "--repeats", "1", "--backbones", "dgcnn", "pointnet"])
    out = capsys.readouterr().out
    result = last_line(out)
    every = ["train_ms", "ms", "parameters", "peak_mb"]
    names = [f"{name}_dgcnn" for name in every] + [f"{name}_pointnet" for name in (*every, "train_speedup")]
    assert list(result) == names
    assert min(result.values()) > 0
    assert result["parameters_pointnet"] == 150_336
    assert "2 clouds of 40 points, 1 thread(s)" in out


@pytest.fixture
def run_folder(tmp_path):
    """A run of three jobs: objects; encoders with two seeds in one job; a table that is written as two files."""
    folder = tmp_path / "toy"

    def sidecar(path, seconds, peak_mb, seed=None):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        record = {"seconds": seconds, "peak_memory_mb": peak_mb, "seed": seed}
        (folder / f"{path}.provenance.json").write_text(json.dumps(record))

    def benchmark(path, seconds, max_rss):
        (folder / "benchmarks" / path).parent.mkdir(parents=True, exist_ok=True)
        row = f"{seconds}\t0:00:01\t{max_rss}\t1\t1\t1\t0\t0\t90\t1.0"
        head = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time"
        (folder / "benchmarks" / path).write_text(f"{head}\n{row}\n")

    sidecar("objects/cup.npz", 2.0, 150.0)
    sidecar("encoders/cup/dgcnn/seed0.pt", 4.0, 500.0, seed=0)
    sidecar("curves/cup/dgcnn/seed0.csv", 4.0, 500.0, seed=0)  # another output of the same block
    sidecar("encoders/cup/dgcnn/seed1.pt", 4.0, 500.0, seed=1)  # equally long, yet another block of work
    for suffix in ("csv", "md"):
        sidecar(f"tables/table1.{suffix}", 1.0, 90.0)
    sidecar("metrics.csv", 1.0, 80.0)
    benchmark("objects/cup.tsv", 3.0, "NA")
    benchmark("encoders/cup/dgcnn.tsv", 10.0, 620.5)
    os.utime(folder / "benchmarks/objects/cup.tsv", (1003.0, 1003.0))
    os.utime(folder / "benchmarks/encoders/cup/dgcnn.tsv", (1013.0, 1013.0))
    for path in folder.rglob("*.json"):
        os.utime(path, (1016.0, 1016.0))
    return folder


def test_work_counts_once_per_block_and_shares_and_overhead_add_up_to_the_core_time(run_folder):
    stages = pipeline.read_stages(run_folder)
    assert list(stages) == ["objects", "encoders", "collect", "tables"]
    assert stages["encoders"].work_s == [4.0, 4.0]
    assert stages["tables"].work_s == [1.0]
    assert stages["objects"].peaks_mb == [150.0]
    result = pipeline.summary(pipeline.read_stages(run_folder), core_s=2 * 10.0)
    assert result["stages"]["encoders"] == {"jobs": 1, "work_s": 8.0, "job_s": 10.0, "peak_mb": 620.5, "share": 0.4}
    assert result["overhead_share"] == pytest.approx(1 - 12 / 20)
    assert sum(stage["share"] for stage in result["stages"].values()) + result["overhead_share"] == pytest.approx(1)
    assert result["peak_mb"] == 620.5


def test_an_existing_run_ends_with_the_documented_line(run_folder, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "ROOT", run_folder.parent)
    (run_folder.parent / "results").mkdir()
    run_folder.rename(run_folder.parent / "results" / "toy")
    assert pipeline.main(["--existing", "toy", "--cores", "2"]) == 0
    result = last_line(capsys.readouterr().out)
    assert list(result) == ["stages", "overhead_share", "peak_mb"]
    assert result["overhead_share"] == pytest.approx(1 - 12 / 32)


def isotropic(registrations, variance_S_K):
    """The outcomes of conditions whose poses scatter alike in all six directions."""
    covariance = variance_S_K[..., None, None] * np.eye(6)
    rest = np.zeros(variance_S_K.shape)
    no, none = rest.astype(bool), rest.astype(int)
    return Outcomes(registrations.sample, registrations.split, covariance, rest, rest, no, none)


def isotropic_divergence(clean, other):
    return 3 * (clean / other - 1 - np.log(clean / other))


@pytest.fixture
def run_with_uncertainty(tmp_path, registrations):
    """Two seeds of one source in which the true concept's knob always widens the scatter most.

    Clean pairs scatter by 1e-6 or next to nothing, and by that alone are very unlike where the floor is low. Observed
    poses scatter by 1e-4, without noise by 1e-6.
    """
    test = registrations.subset(registrations.rows("test"))
    true_S_3 = test.concept[:, None] == np.array(CONCEPTS)
    knobs_K_3 = np.vstack([(np.arange(8)[:, None] >> np.arange(3)) & 1, 0.1 * np.eye(3)])
    additive = 1e-6 * 10 ** (np.where(true_S_3, 3, 1) @ knobs_K_3.T)
    clean_S = np.where(np.arange(len(test)) % 2, 1e-6, 1e-10)
    causal = np.column_stack([np.full(len(test), 1e-6), clean_S, np.where(true_S_3[:, 0], 1e-6, 1e-4)])
    assert [variances.shape[1] for variances in (additive, causal)] == [
        len(CONDITIONS[design]) for design in floor.DESIGNS_READ
    ]
    for seed in (0, 1):
        (path := tmp_path / "registrations" / "tiny" / f"seed{seed}.npz").parent.mkdir(parents=True, exist_ok=True)
        registrations.save(path)
        for design, variances in (("additive", additive), ("causal", causal)):
            isotropic(test, variances).save(tmp_path / "uncertainty" / "tiny" / design / path.name, ("tiny", seed))
    return tmp_path


def test_the_floor_decides_who_is_causal(run_with_uncertainty, capsys):
    assert floor.main([str(run_with_uncertainty)]) == 0
    printed = capsys.readouterr().out
    assert "tiny: 2 seed(s), samples 36 (additive), 36 (causal)" in printed
    (by_floor,) = last_line(printed).values()
    assert list(by_floor) == ["1e-09", "1e-08", "1e-07", "1e-06", "1e-05", "1e-04", "1e-03"]
    for name, numbers in by_floor.items():
        epsilon = float(name)
        assert numbers["shap_additive"] == numbers["sa_local_additive"] == 1
        unlike, wide = (isotropic_divergence(1e-6 + epsilon, other + epsilon) for other in (1e-10, 1e-4))
        assert numbers["clean_95th"] == pytest.approx(unlike, rel=1e-3)
        assert numbers["clean_median"] == pytest.approx(unlike / 2, rel=1e-3)
        shares = [numbers["causal"], *(numbers[f"causal_{concept}"] for concept in CONCEPTS)]
        assert shares == pytest.approx([2 / 3, 0, 1, 1] if wide > unlike else [0, 0, 0, 0], abs=1e-4)
    assert by_floor["1e-09"]["causal"] < by_floor["1e-06"]["causal"]


def test_a_run_without_uncertainty_is_one_line_and_status_2(run_with_uncertainty, tmp_path_factory, capsys):
    assert floor.main([str(tmp_path_factory.mktemp("empty"))]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    (run_with_uncertainty / "uncertainty" / "tiny" / "causal" / "seed1.npz").unlink()
    assert floor.main([str(run_with_uncertainty)]) == 2
    assert "causal/seed1.npz: no such file" in capsys.readouterr().err


def test_active_learning_compares_equal_bald_and_ends_with_its_numbers(capsys):
    from benchmarks import active_learning

    active_learning.main(["--pool", "30", "--labels", "12", "--draws", "20", "--repeats", "1"])
    out = capsys.readouterr().out
    result = last_line(out)
    assert list(result) == ["bald_speedup", "select_ms", "retrain_s", "max_abs_error"]
    assert result["max_abs_error"] < 1e-9
    assert "BALD of 30 embeddings, 20 draws" in out


def test_latency_times_whole_commands_of_an_installed_package(tmp_path, capsys):
    from benchmarks import latency

    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    latency.main(["--installed", str(python), "--repeats", "1"])
    said = json.loads(capsys.readouterr().out)
    assert said.pop("python") == str(python)
    assert [*said] == ["first_cpu_s", "first_peak_mb", "later_cpu_s", "later_peak_mb", "packages_mb", "packages"]
    assert all(value > 0 for value in said.values())


def test_registration_ends_with_the_numbers_of_each_method(capsys):
    from benchmarks import registration

    tiny = ["--samples", "6", "--points", "64", "--repeats", "1"]
    registration.main([*tiny, "--methods", "point_to_point", "huber", "teaser", "kiss_matcher"])
    out = capsys.readouterr().out
    result = last_line(out)
    measured = ["point_to_point", "huber", "teaser"]
    if "kiss_matcher            skipped: the package kiss_matcher is not installed" not in out:
        measured.append("kiss_matcher")
    names = [f"{number}_{name}" for name in measured for number in ("ms", "ratio")]
    assert list(result) == ["reference_ms", "normals_ms", *names]
    assert min(result.values()) > 0
    assert "6 pairs of up to 64 points" in out


def test_settings_of_methods_are_compared_on_the_same_pairs(tmp_path, objects, registrations, capsys):
    from benchmarks import registration_settings

    for folder, saved in (("objects/tiny.npz", objects), ("registrations/tiny/seed100.npz", registrations)):
        (tmp_path / folder).parent.mkdir(parents=True)
        saved.save(tmp_path / folder, *([("tiny", 100)] if saved is registrations else ["tiny"]))
    registration_settings.main([str(tmp_path), "--pairs", "6", "--methods", "point_to_point"])
    out = capsys.readouterr().out
    names = ["posterior", "point_to_point", "point_to_point correspondence_distance=0.25"]
    assert list(last_line(out)) == [f"success_{name}" for name in names]
    assert out.startswith("6 pairs, ") and all(f"| {name} | " in out for name in names)


def test_results_of_unseen_families_are_judged_by_what_learned_and_was_calibrated_on_others():

    from benchmarks import results
    from gpca.model.diagnoser import TrainingSet

    random, n = np.random.default_rng(0), 400
    error_N = np.exp(random.uniform(np.log(0.003), np.log(0.4), size=n))
    samples = TrainingSet(
        features_N_F=np.zeros((n, 1)), causes_N_3=np.ones((n, 3), bool),
        label_N=np.full(n, "pose"), dominant_N=np.full(n, "pose"),
        shown_error_N=error_N, family_N=np.arange(n) % 8,
        distance_N_K=(error_N * np.exp(0.1 * random.normal(size=n)))[:, None],
        weight_N_K=np.ones((n, 1)), inlier_rmse_N=random.random(n), fitness_N=random.random(n),
    )  # fmt: skip
    judged = results.judge_unseen(samples, 0.03)
    found = results.measured(samples, judged, 0.03, np.arange(n), "")
    assert found["auroc"] > 0.98
    assert found["false_alarms"] < 0.08
    assert (found["good"], found["families"]) == ((error_N <= 0.03).sum(), 8)


def test_gpc_compares_equal_fits_and_ends_with_its_numbers(capsys):
    from benchmarks import gpc

    gpc.main(["--samples=24", "--width=6", "--inducing=5", "--iterations=4", "--draws=20", "--repeats=1"])
    result = last_line(capsys.readouterr().out)
    seconds = ["fit_s", "gpytorch_fit_s", "fit_speedup", "one_sample_ms", "ms_200_samples", "gpytorch_ms_200_samples"]
    assert list(result) == [*seconds, "max_abs_error", "max_score_difference"]
    assert max(result["max_abs_error"], result["max_score_difference"]) < 1e-3
    assert min(result[name] for name in seconds) > 0


def test_causes_end_with_the_seconds_of_a_truth_and_the_shares_of_the_states(capsys):
    from benchmarks import causes

    causes.main(["--candidates", "8", "--family", "linemod"])
    result = last_line(capsys.readouterr().out)
    assert list(result)[:3] == ["truth_s", "speedup", "max_error_difference"]
    assert min(result["truth_s"], result["speedup"]) > 0
    assert result["max_error_difference"] < 1e-6
    for shares in (("nominal", "borderline", "failed"), ("failed_by_noise", "failed_by_pose", "failed_by_overlap")):
        assert sum(result[name] for name in shares) == pytest.approx(1)
    assert 0 <= result["ceiling"] <= 1


def test_limits_of_labels_are_tested_on_the_other_registrations(monkeypatch, capsys):
    from benchmarks import calibration
    from gpca.model.explainer import Explainer
    from gpca.model.location import SHIPPED

    explainer = Explainer.load(SHIPPED)
    (one, _), (two, right) = calibration.registered(explainer, 2, "3%", shifted=True)
    assert one.result != two.result and isinstance(right, bool)
    for name, value in (("COUNTS", (40,)), ("REPEATS", 5)):
        monkeypatch.setattr(calibration, name, value)
    wrong_N = np.arange(100) % 2 == 0
    diagnoses = [replace(one, result=0.1 + 0.8 * wrong + 0.001 * n, void=False) for n, wrong in enumerate(wrong_N)]
    found = calibration.compared(explainer.model.diagnoser, diagnoses, (~wrong_N).tolist())
    assert (found["samples"], found["right"]) == (100, 50)
    assert found["failures_called_good_40"] < 0.2 and found["sets_hold_the_truth_40"] > 0.7
    assert "not sure" in capsys.readouterr().out
