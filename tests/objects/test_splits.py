import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.canonical import DRAWN, TRAINING, drawn, read_scene_splits, unseen


def test_a_share_of_the_clusters_at_least_one_and_never_all_is_unseen():
    clusters = np.array([f"part{i}" for i in range(10)])
    assert drawn(clusters, 0.2, "mine", 0).sum() == 2
    assert drawn(clusters[:3], 0.2, "mine", 0).sum() == 1
    assert drawn(clusters[:3], 0.9, "mine", 0).sum() == 2
    assert not drawn(clusters[:1], 0.5, "mine", 0).any()
    assert np.array_equal(drawn(clusters, 0.2, "mine", 0), drawn(clusters[::-1], 0.2, "mine", 0)[::-1])
    assert len({tuple(drawn(clusters, 0.2, "mine", seed)) for seed in range(5)}) > 1


def test_all_rows_of_a_cluster_are_drawn_together():
    clusters = np.array(["cup", "box", "cup", "can", "box"])
    for seed in range(5):
        is_unseen = drawn(clusters, 0.4, "mine", seed)
        assert len(set(clusters[is_unseen])) == 1
        assert not set(clusters[is_unseen]) & set(clusters[~is_unseen])


def test_seeds_take_turns_with_folds_and_what_only_training_sees_is_never_unseen():
    folds = np.array([0, 3, TRAINING, 3, 0])
    assert [np.flatnonzero(unseen(folds, seed)).tolist() for seed in range(3)] == [[0, 4], [1, 3], [0, 4]]
    assert unseen(np.full(4, DRAWN), 0) is None
    assert unseen(np.array([1, 1, DRAWN]), 0) is None  # one fold: nothing would be left to train on


def test_a_scene_says_what_its_poses_are_worth(tmp_path):
    path = tmp_path / "scenes.csv"
    rows = "a,1,evaluation,0,icp,carried\na,2,evaluation,0,annotated,image\n"
    path.write_text(f"dataset,scene,role,fold,truth,estimates\n{rows}")
    places = read_scene_splits(path, "a")
    assert [place[3:] for place in places.values()] == [("icp", "carried"), ("annotated", "image")]
    path.write_text("dataset,scene,role,fold\na,1,evaluation,0\n")
    assert read_scene_splits(path, "a")[1][3:] == ("annotated", "image")
    path.write_text("dataset,scene,role,fold,truth\na,1,evaluation,0,guessed\n")
    with pytest.raises(InputError, match="scene 1 of a has 'guessed' as truth; choose one of annotated, icp"):
        read_scene_splits(path, "a")
