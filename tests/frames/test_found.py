"""What the documentation says was found on depth frames, held against the reference run on real ones."""

import re

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped

TABLES = ROOT / "results/reference/real/tables"


def cells(table, *keys):
    return pd.read_csv(TABLES / f"{table}.csv").set_index(list(keys))["mean"].sort_index()


def test_what_was_found_of_backbones_stands_in_the_reference():
    found, by = unwrapped("docs/real_world.md"), cells("table6_seen_unseen", "condition", "method", "samples")
    frames = by.loc["real_rgbd"].unstack()
    unreduced = frames[frames.index.str.endswith("-none") & ~frames.index.str.startswith("analytical")]
    best = unreduced.idxmax()
    assert (best["attribution"], best["seen"], best["unseen"]) == ("dgcnn-none", "dgcnn-none", "pointnet2-none")
    dgcnn, pair = frames.loc["dgcnn-none"], frames.loc["gpca_pair"]
    assert f"DGCNN reaches {dgcnn['attribution']:.1f} %" in found
    assert f"GP-CA reaches {dgcnn['attribution']:.1f} %" in (ROOT / "README.md").read_text()
    assert f"PointNet++ reaches {frames.loc['pointnet2-none', 'attribution']:.1f} %" in found
    seen = f"DGCNN is best with {dgcnn['seen']:.1f} % (PointNeXt-S {frames.loc['pointnext-none', 'seen']:.1f} %)"
    assert f"On seen objects {seen}" in found
    unseen = f"PointNet++ with {frames.loc['pointnet2-none', 'unseen']:.1f} % (DGCNN {dgcnn['unseen']:.1f} %)"
    assert f"on unseen ones {unseen}" in found
    assert f"PointNet stays at {frames.loc['pointnet-none', 'attribution']:.1f} %" in found
    assert f"on the pair reaches {pair['attribution']:.1f} %**, and {pair['unseen']:.1f} % on unseen" in found
    [other] = set(by.index.get_level_values("condition")) - {"real_rgbd"}
    estimated = by.loc[other].unstack()["attribution"]
    assert f"it reaches {estimated['gpca_pair']:.1f} %, DGCNN {estimated['dgcnn-none']:.1f} %" in found


def test_what_was_found_of_confusions_stands_in_the_reference():
    compared = pd.read_csv(TABLES.parent / "comparison.csv")
    rows = compared[compared["row"].str.startswith("DGCNN, depth frames")].set_index("column")["reproduced"]
    words = f"pose for overlap in {rows['Taken for overlap']:.1f} % of the cases and overlap for pose in"
    assert f"{words} {rows['Taken for pose']:.1f} %" in unwrapped("docs/real_world.md")


def test_what_was_found_of_labels_stands_in_the_reference():
    labels = cells("table6_labels", "seen", "quantity")
    assert labels.unstack()["validation"].idxmax() == "pointnet2"
    by_bald, at_random = (labels.loc["pointnet2", name] for name in ("bald_kmeans_70", "random_70"))
    assert f"70 % with {by_bald:.0f} labels by BALD and {at_random:.0f} at random" in unwrapped("docs/real_world.md")
    assert f"active learning saves {100 * (1 - by_bald / at_random):.0f} % of them" in unwrapped("docs/real_world.md")


def test_what_was_found_of_causes_stands_in_the_reference():
    found = unwrapped("docs/causes.md")
    note = (TABLES / "table9_frames.md").read_text()
    told = (
        r"Of (\d+) registrations .* (\d+) failed: (\d+) mostly by noise, (\d+) mostly by pose, (\d+) mostly by overlap"
    )
    samples, failed, noise, pose, overlap = map(int, re.search(told, note).groups())
    assert f"Of {samples} registrations, {failed} failed" in found
    assert f"{pose} mostly by the estimator's pose, {noise} by noise, {overlap} by missing surface" in found
    always = 100 * pose / failed
    assert f'as the constant answer "pose" would** ({always:.0f} %)' in found
    rows = cells("table9_frames", "explainer", "metric").unstack()
    area, dominant = rows["auroc_failed"], rows["dominant_accuracy"]
    assert f"AUROC {area['residuals']:.3f} and {area['gpca_pair']:.3f}" in found
    assert f"against {area['gate_rmse']:.3f} for the inlier RMSE and {area['gpca']:.3f} for GP-CA" in found
    assert dominant.drop("ceiling").max() < always
    assert (
        f"descriptors reaches {dominant['pair_boosting']:.0f} %, GP-CA on the pair {dominant['gpca_pair']:.0f} %"
        in found
    )
