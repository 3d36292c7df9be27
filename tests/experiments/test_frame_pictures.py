"""Pictures of depth frames; beside the other tests of frames, whose tiny dataset they need."""

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.metrics import collect
from gpca.attribution.predictions import write_predictions
from gpca.classifier.scores import Attribution
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import write_metrics
from gpca.experiments.frame_pictures import (
    choose_sample,
    covered,
    draw_real_world_confusions,
    draw_real_world_example,
    read_samples,
)
from gpca.experiments.frames import read_together
from gpca.frames.synthesis import OCCLUDER, FrameSettings, make_frame_registrations
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import RegistrationSettings


def run_of(*backbones, explainers=()):
    frames = {
        "title": "Frames",
        "datasets": {"lm": {}},
        "backbones": backbones,
        "reductions": ["none"],
        "explainers": explainers,
    }
    return Run({"real_world": frames, "success": {"error": 0.03}})


RUN = run_of("dgcnn")


@pytest.fixture(scope="module")
def results(tiny, tmp_path_factory):
    """Files of one seed in which samples 0 and 3 of the test split are attributed wrongly, 3 more confidently."""
    folder = tmp_path_factory.mktemp("results")
    instances, objects = tiny
    settings = FrameSettings(occluders=1.0, registration=RegistrationSettings(train=9, test=12, cloud_points=128))
    registrations, _, poses = make_frame_registrations(instances, objects, "real_rgbd", 0, settings)
    scores_N_C = np.array([np.where(np.array(CONCEPTS) == c, 0.8, 0.1) for c in registrations.concept])
    test = registrations.rows("test")
    for row, top in ((test[0], 0.6), (test[3], 0.9)):
        scores_N_C[row] = np.roll(np.where(scores_N_C[row] > 0.5, top, (1 - top) / 2), 1)
    attribution = Attribution.of_scores(CONCEPTS, scores_N_C, seconds=0.0)
    instances.save(folder / "instances.npz", ("tiny", None))
    registrations.save(folder / "registrations.npz")
    write_csv(folder / "poses.csv", poses)
    predictions = folder / "real_rgbd/dgcnn-none/seed0.csv"
    filled = Attribution(
        **{**vars(attribution), "variances_N_C": np.full(scores_N_C.shape, 0.01), "bald_N": np.zeros(len(scores_N_C))}
    )
    write_predictions(predictions, registrations, filled)
    write_metrics(collect([predictions]), folder / "metrics.csv")
    objects.save(folder / "objects.npz", "tiny")
    return folder


def test_fig5_shows_a_test_sample_that_an_occluder_covers_and_that_is_named_right(results):
    samples = read_samples(results / "poses.csv", results / "real_rgbd/dgcnn-none/seed0.csv")
    pixels_I = np.arange(samples["instance"].max() + 1)
    shown = samples.iloc[choose_sample(samples, "predictions", pixels_I, 0.03)]
    assert (shown["split"], shown["concept_true"], shown["lost_to"]) == ("test", "overlap", OCCLUDER)
    wrong = samples.assign(concept_predicted="noise")
    assert wrong.iloc[choose_sample(wrong, "predictions", pixels_I, 0.03)]["concept_true"] == "overlap"
    with pytest.raises(InputError, match="has no test sample of overlap"):
        choose_sample(samples[samples["concept_true"] != "overlap"], "predictions", pixels_I, 0.03)


SHOWABLE = {"split": "test", "concept_true": "overlap", "concept_predicted": "overlap", "lost_to": OCCLUDER}


def test_fig5_shows_an_object_that_is_large_in_its_image_and_that_icp_made_wrong():
    known = {"init_error": 0.01, "icp_error": 0.05, "instance": range(5), "sample": range(5)}
    samples = pd.DataFrame(SHOWABLE | known | {"score_overlap": [0.9, 0.8, 0.7, 0.6, 0.5]})
    assert choose_sample(samples, "predictions", np.array([100, 3, 200, 1, 300]), 0.03) == 2  # the median of 0, 2 and 4
    errors = {"init_error": [0.01, 0.05, 0.01], "icp_error": [0.02, 0.06, 0.07], "score_overlap": [0.7, 0.8, 0.9]}
    samples = pd.DataFrame(SHOWABLE | {"instance": range(3), "sample": range(3)} | errors)
    for shown, number in ((2, 3), (1, 2), (0, 1)):
        assert choose_sample(samples[:number], "predictions", np.array([300, 200, 100][:number]), 0.03) == shown


def test_what_is_covered_is_what_lies_not_between_the_points_that_were_kept():
    v, u = np.mgrid[10:40, 20:60]
    own = np.column_stack([u.ravel(), v.ravel()])
    left = own[own[:, 0] < 40]
    some = left[np.random.default_rng(0).permutation(len(left))[:300]] + 0.3  # every other one, between the pixels
    mask = covered(own, some, (50, 80))
    assert mask[12:38, 44:60].all()
    assert not mask[12:38, 22:38].any()
    assert not mask[:10].any() and not mask[:, 60:].any()


@pytest.mark.parametrize("picture", ["example", "confusions"])
def test_a_picture_is_drawn_and_drawing_again_changes_no_byte(picture, results, same_bytes):
    poses, predictions = results / "poses.csv", results / "real_rgbd/dgcnn-none/seed0.csv"
    instances, objects, registrations = (results / f"{name}.npz" for name in ("instances", "objects", "registrations"))
    of_example = instances, objects, registrations, poses, predictions
    draw = {
        "example": lambda: draw_real_world_example(RUN, *of_example),
        "confusions": lambda: draw_real_world_confusions(RUN, read_together(results / "metrics.csv")),
    }
    assert same_bytes(draw[picture]).std() > 5


def test_files_of_other_samples_and_metrics_of_other_methods_are_refused(results, tmp_path):
    poses = pd.read_csv(results / "poses.csv", dtype=str, keep_default_na=False)
    write_csv(tmp_path / "poses.csv", poses[::-1])
    with pytest.raises(InputError, match="its samples differ from"):
        read_samples(tmp_path / "poses.csv", results / "real_rgbd/dgcnn-none/seed0.csv")
    with pytest.raises(InputError, match="are of none of these explainers"):
        draw_real_world_confusions(run_of("pointnet"), read_together(results / "metrics.csv"))
