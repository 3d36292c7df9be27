"""Whether `gpca explain --scans` tells right registrations of scans from wrong ones, on scenes of development.

    python benchmarks/scan_judgment.py --data /data [--pairs 4] [--out judged.csv] [--from judged.csv]

The protocol is in docs/appendix.md. Prints AUROC, false alarms, missed failures and how often overlap is named, with
Wilson's intervals, and the coefficients that a logistic regression fits to the evidence, with its AUROC over scenes
that it was not fitted to. The last line is a JSON object.
"""

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

AXES = ("scan judgment", 100)  # of the random numbers, those of development
STRATA = (0.1, 0.3, 0.5, 0.7, 1.0)
RUNGS = ((0, 0), (10, 0.1), (20, 0.25), (40, 0.5), (60, 1.0))  # degrees, meters
VIRTUAL = {"rooms": 3, "objects": 2, "views": 8}
POINTS = 20000


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", help="folder with scans/3dmatch; virtual scenes alone without it")
    parser.add_argument("--pairs", type=int, default=6, help="of each real scene and stratum of overlap, at most")
    parser.add_argument("--out", type=Path, help="file for a row of each registration")
    parser.add_argument("--from", dest="judged", type=Path, help="such a file, to be summed up again")
    options = parser.parse_args(arguments)
    prepare()
    import pandas as pd

    table = pd.read_csv(options.judged) if options.judged else judge(options.data, options.pairs)
    if options.out:
        table.to_csv(options.out, index=False)
    summed = sum_up(table)
    if "apart" in table:
        summed |= fit(table)
    print(json.dumps({name: round(float(value), 4) for name, value in summed.items()}))


def judge(data: str | None, most: int):
    """Return a row of each registration."""
    import pandas as pd

    from gpca.process.progress import progress
    from gpca.scans.pair import Rung, disturbed, rungs_of
    from gpca.scans.scene import choose_pairs
    from gpca.scans.source import DEVELOPMENT, entry_of, place_of, scenes_of

    config = json.loads(json.dumps(_config()["scans"]["datasets"]))
    entries = {"virtual_scans": -(-most // 2), **({"threedmatch": most} if data else {})}
    rows = []
    for name, most_of_scene in entries.items():
        entry = entry_of(config[name] | (VIRTUAL if name == "virtual_scans" else {}))
        scenes = scenes_of(entry, place_of(entry, data), DEVELOPMENT, POINTS)
        pairs = choose_pairs(scenes, STRATA, most_of_scene, *AXES)
        rungs = rungs_of(len(pairs), [Rung(*rung) for rung in RUNGS], *AXES)
        for pair, rung in progress(list(zip(pairs, rungs, strict=True)), entry.title):
            row = {"scene": pair.scene, "pair": pair.name, "true_overlap": pair.overlap, "rung": rung.name}
            rows.append(row | judged(pair, disturbed(pair, rung, *AXES)))
    return pd.DataFrame(rows)


def _config() -> dict:
    import yaml

    return yaml.safe_load((ROOT / "config/config.yaml").read_text("utf-8"))


def judged(pair, T_init) -> dict:
    """Return what is said of a registration, and what is true of it."""
    from time import process_time

    from gpca import explain_scans
    from gpca.scans.pair import overlap_rmse

    started = process_time()
    said = explain_scans(pair.source_N_3, pair.target_M_3, T_init)
    row = {"state": said.state, "failure": said.failure, "limit": said.limit, "overlap": said.overlap[0]}
    row |= {"seconds": process_time() - started, "error": overlap_rmse(pair, said.T_target_source)}
    row |= {"rmse": said.inlier_rmse / said.voxel, "fitness": said.fitness, "action": said.action, "voxel": said.voxel}
    true = [overlap_rmse(pair, pose.T_target_source) for pose in said.reenacted.poses]
    row |= {"best_pose": min(true), "first_pose": true[0], "listed": any(p.registered for p in said.reenacted.poses)}
    if hasattr(said, "evidence"):
        row |= {"elsewhere": said.evidence.elsewhere, "apart": said.evidence.apart, "causes": " ".join(said.causes)}
    if row["error"] > said.limit:
        row["by_overlap"] = caused_by_overlap(pair, T_init, row["error"], said.voxel)
    return row


def caused_by_overlap(pair, T_init, error: float, voxel: float) -> float:
    """Return what overlap adds to the error of a failure less what the pose does, by Shapley values of the two."""
    import numpy as np

    from gpca.model.scan_explainer import _prepared
    from gpca.scans.pair import overlap_rmse

    def v(T_start, common: bool) -> float:
        keep = (pair.source_common_N, pair.target_common_M) if common else (slice(None), slice(None))
        clouds = {"source": pair.source_N_3[keep[0]], "target": pair.target_M_3[keep[1]]}
        scans, frame = _prepared(clouds, np.array(T_start), "m", voxel, [])
        return overlap_rmse(pair, frame.pose_outside(scans.registered().T_target_source) @ T_start)

    try:
        alone, at_truth, neither = v(T_init, True), v(pair.T_target_source, False), v(pair.T_target_source, True)
    except ValueError:
        return float("nan")
    overlap = (error - alone + at_truth - neither) / 2
    pose = (error - at_truth + alone - neither) / 2
    return overlap - pose


def sum_up(table) -> dict[str, float]:
    """Print and return how well failures are told."""
    from sklearn.metrics import roc_auc_score

    from gpca.evaluation.intervals import wilson_interval

    wrong = table["error"] > table["limit"]
    summed = {"registrations": len(table), "failures": wrong.sum(), "seconds": table["seconds"].mean()}
    print(f"{len(table)} registrations, {wrong.sum()} of them wrong, {table['seconds'].mean():.2f} s of CPU each")

    def share(name: str, among, hits) -> None:
        found, n = int((hits & among).sum()), int(among.sum())
        if n:
            low, high = wilson_interval(found, n)
            print(f"{name:44} {found:4} of {n:4}, {found / n:.3f} ({low:.3f} to {high:.3f})")
            summed[name.replace(" ", "_")] = found / n

    for name in ("failure", "rmse", "fitness"):
        summed[f"auroc_{name}"] = roc_auc_score(wrong, table[name] if name != "fitness" else -table[name])
        print(f"AUROC of {name:35} {summed[f'auroc_{name}']:.3f}")
    state = table["state"]
    share("right called failed", ~wrong, state == "failed")
    share("right called nominal", ~wrong, state == "nominal")
    share("wrong called nominal", wrong, state == "nominal")
    share("wrong called failed", wrong, state == "failed")
    share("little overlap called not sure", (table["overlap"] > 0) & (table["overlap"] < 0.2), state == "not sure")
    share("result among its poses", state == state, table["listed"])
    share("right pose listed of wrong results", wrong, table["best_pose"] < table["limit"])
    near = table["rung"].isin(["0deg_0m", "10deg_0.1m", "20deg_0.25m"])
    share("right from up to 20 deg", near, ~wrong)
    share("right from 40 deg on", ~near, ~wrong)
    if "causes" in table:
        mostly = wrong & (table["by_overlap"] > 0)
        named = table["causes"].fillna("").str.contains("overlap")
        share("overlap named where it causes the failure", mostly, named)
        share("overlap named where the pose does", wrong & (table["by_overlap"] < 0), named)
        share("new view advised where overlap causes it", mostly, table["action"] == "new_view")
    return summed


def fit(table) -> dict[str, float]:
    """Print and return the coefficients of the probability of a failure, and its AUROC over scenes left out."""
    import numpy as np
    from sklearn.linear_model import LogisticRegression
    from sklearn.metrics import roc_auc_score

    wrong = (table["error"] > table["limit"]).to_numpy()
    log_apart = np.log(np.maximum(table["apart"], 1e-6))
    features = np.column_stack([table["elsewhere"], log_apart])
    use, p = (table["overlap"] > 0).to_numpy(), np.full(len(table), 1.0)
    for scene in table["scene"].unique():
        test = (table["scene"] == scene).to_numpy()
        p[test & use] = LogisticRegression(C=10).fit(features[use & ~test], wrong[use & ~test]).predict_proba(
            features[test & use])[:, 1]  # fmt: skip
    model = LogisticRegression(C=10).fit(features[use], wrong[use])
    names = ("elsewhere", "log_apart")
    result = {f"of_{name}": value for name, value in zip(names, model.coef_[0], strict=True)}
    result |= {"intercept": model.intercept_[0], "auroc_left_out": roc_auc_score(wrong, p)}
    print({name: round(float(value), 3) for name, value in result.items()})
    for low in (0.1, 0.2, 0.5, 0.8, 0.9):
        print(f"from {low}: false {(p >= low)[~wrong].mean():.3f}, missed {(p < low)[wrong].mean():.3f}")
    return result


if __name__ == "__main__":
    main()
