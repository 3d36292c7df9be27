"""Benchmarks of the encoders' training: convergence, and two devices."""

from ..test_benchmarks import last_line


def test_an_encoder_has_converged_where_no_longer_training_is_better(tmp_path, capsys):
    """Of two seeds, in accuracy or in loss; the row of a training that is there is not computed again."""
    from benchmarks import convergence

    by_epochs = {3: (0.70, 0.80), 6: (0.90, 0.93), 12: (0.91, 0.92), 24: (0.90, 0.93)}
    rows = [
        dict.fromkeys(convergence.COLUMNS, "0.5")
        | {"backbone": "dgcnn", "epochs": str(epochs), "seed": str(seed), "head_accuracy": str(accuracy)}
        for epochs, accuracies in by_epochs.items()
        for seed, accuracy in enumerate(accuracies)
    ]
    convergence.write_rows(tmp_path / "rows.csv", rows)
    convergence.main(["--out", str(tmp_path / "rows.csv")])
    out = capsys.readouterr().out
    assert last_line(out) == {"converged_dgcnn": 6}
    assert "75.0" in out  # mean accuracy after 3 epochs
    page = tmp_path / "page.md"
    page.write_text("<!-- times of convergence -->\n<!-- end of convergence -->\n")
    falling = [row | {"loss": str({3: 0.9, 6: 0.5, 12: 0.3, 24: 0.26}[int(row["epochs"])])} for row in rows]
    convergence.write_rows(tmp_path / "falling.csv", falling)
    convergence.main(["--out", str(tmp_path / "falling.csv"), "--write", str(page)])
    assert last_line(capsys.readouterr().out) == {"converged_dgcnn": 12}
    assert "| dgcnn | **12** | 2 | 0.300 | 91.5 |" in page.read_text()
    assert (tmp_path / "convergence.png").is_file()
    no_seed_in_common = [row | {"seed": row["epochs"]} for row in rows[::2]]
    for unknown in (rows[:4], no_seed_in_common):
        convergence.write_rows(tmp_path / "rows.csv", unknown)
        convergence.main(["--out", str(tmp_path / "rows.csv")])
        assert last_line(capsys.readouterr().out) == {"converged_dgcnn": None}


def test_convergence_trains_and_judges_an_encoder(tmp_path, registrations, monkeypatch):
    from benchmarks import convergence

    monkeypatch.setattr(convergence, "CHECKPOINTS", tmp_path)

    registrations.save(tmp_path / "ycb/seed100.npz", ("ycb", 100))
    out = tmp_path / "rows.csv"
    convergence.main([str(tmp_path / "ycb/seed100.npz"), "--backbones", "pointnet", "--epochs", "1", "--out", str(out)])
    [row] = convergence.read_rows(out)
    assert (row["backbone"], row["epochs"], row["seed"]) == ("pointnet", "1", "100")
    assert 0 <= float(row["gpc_accuracy"]) <= 1
    assert float(row["loss"]) > 0


def test_two_devices_are_compared_by_time_and_agreement(tmp_path, registrations, capsys):
    """On one device twice, all numbers are the same; without CUDA there is nothing to compare."""
    import torch

    from benchmarks import devices

    registrations.save(tmp_path / "seed100.npz", ("ycb", 100))
    command = [str(tmp_path / "seed100.npz"), "--backbones", "pointnet", "--epochs", "1"]
    assert devices.main([*command, "--devices", "cpu", "cpu"]) == 0
    found = last_line(capsys.readouterr().out)
    assert [found[f"{name}_pointnet"] for name in ("first_loss", "accuracy", "max_abs_error")] == [0, 0, 0]
    assert min(found[f"{name}_speedup_pointnet"] for name in ("train", "embed")) > 0
    if not torch.cuda.is_available():
        assert devices.main(command) == 2
        assert "no CUDA device" in capsys.readouterr().err
