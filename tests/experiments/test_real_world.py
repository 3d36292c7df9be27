"""Encoders as published beside the judged rows of Table VI, and the same rows from other initial poses: their names."""

from copy import deepcopy

import pytest

from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.errors import InputError
from gpca.experiments.frames import pretraining_of
from gpca.experiments.run import explainer_of, files_behind, names_of

from ..config.configs import changed, load


def test_the_full_protocol_has_them_with_every_reduction_and_the_default_has_none():
    config = without_false(load("full"))
    sources = check(deepcopy(config))
    names = names_of(config, sources)
    assert names["published"][0] == "dgcnn_1024-none" and len(names["published"]) == 4
    assert explainer_of("dgcnn_1024-umap", names) == "gpca"
    behind = files_behind("dgcnn_1024-pca", names)["embeddings"]
    assert behind == "embeddings/{source}/dgcnn_1024/pca/seed{seed}.npz"
    assert names["condition_backbone"] == names["backbone"] and len(names["backbone"]) == 16
    assert {"frame_encoder", "frame_start"} <= set(names["reading_group"])
    assert names["estimated"] == "real_rgbd_estimated"
    assert list(config["real_world"]["published"].values()) == ["dgcnn_1024"]
    assert names["published_seed"] == config["seeds"][:1]
    assert names["frame_seed"] == list(range(15))
    last_seeds = {name.rpartition("/")[0]: name.rpartition("/")[2] for name in names["frame_prediction"]}
    rows = ("real_rgbd/dgcnn-none", "real_rgbd/rule", "real_rgbd/dgcnn_1024-none", "real_rgbd_estimated/dgcnn-none")
    assert [last_seeds[row] for row in rows] == ["seed14", "seed14", "seed0", "seed4"]
    assert names["frame_pose"][14:17] == ["real_rgbd/seed14", "real_rgbd_estimated/seed0", "real_rgbd_estimated/seed1"]
    usual = names_of(without_false(load()), sources)
    assert usual["frame_seed"] == usual["seed"] == [0, 1, 2]
    few = without_false(changed("real_world.seeds", 4) | {"seeds": [7, 9]})
    assert names_of(few, sources)["frame_seed"] == [7, 9, 10, 11]
    for name, epochs in {"dgcnn": 10, "dgcnn_1024": 5}.items():
        assert pretraining_of(config["real_world"], name)["epochs"] == epochs
    assert usual["published"] == [] and usual["condition_backbone"] == ["dgcnn-none"]
    assert not {"frame_encoder", "frame_start"} & set(usual["reading_group"])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("real_world.published", {"dgcnn": "dgcnn2"}, "real_world.published: no encoder 'dgcnn2'; choose one of dgcnn"),
        ("real_world.published", {"pointnet3": "dgcnn_1024"}, "real_world.published: no encoder 'pointnet3'"),
        ("real_world.published", {"dgcnn": "pointnet"}, "real_world.published: 'pointnet' has rows already"),
        (
            "real_world.published",
            {"dgcnn": "dgcnn_1024", "pointnet": "dgcnn_1024"},
            "real_world.published: 'dgcnn_1024' has rows already",
        ),
        ("real_world.reductions", ["pca"], "real_world.condition_reductions: no reduction 'none'; choose one of pca"),
        ("real_world.condition_reductions", ["tsne"], "real_world.condition_reductions.0: 'tsne' should be"),
        ("method_pairs.points_of", {"icp": 512}, "method_pairs.points_of: no registration method 'icp'"),
        ("method_pairs.neighbors_of", {"icp": 40}, "method_pairs.neighbors_of: no registration method 'icp'"),
        ("method_pairs.points_of", {"fgr": 10}, "method_pairs.points_of.fgr: 10 should be greater than or equal to 64"),
    ],
)
def test_names_that_nothing_has_are_refused(key, value, message):
    with pytest.raises(InputError, match=message):
        check(without_false(changed(key, value)))
