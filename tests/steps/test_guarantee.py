"""The step on two sources of two seeds: who learns from whom, and what is said of faulty files."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import prediction_frame, write_predictions
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import WIDTHS, Descriptors
from gpca.causes.drawing import draw_causes
from gpca.causes.settings import GROUPS, CauseSettings
from gpca.causes.truth import BORDERLINE
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.guarantee.answers import Scored
from gpca.guarantee.guarantee import states_of
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.reenactment.dataset import Reenactments
from gpca.steps import guarantee as step
from gpca.steps.guarantee import parts_of, read_pool
from tests.conftest import FEW_CAUSES

AXES = [(source, seed) for source in ("cups", "tools") for seed in (100, 101)]
EXPLAINERS = {"pair_forest": {"trees": 5}, "reenact": None, "gpca": None}


def write_measurements(folder, causes, axes, random):
    """Files of causes, descriptors and re-enactments with made-up numbers, and predictions that every file has."""
    source, seed = axes
    place = f"{source}/seed{seed}"
    registrations = replace(causes.registrations, axes=axes)
    n = len(registrations)
    paths = {name: folder / name / f"{place}.npz" for name in ("causes", "descriptors", "reenactments")}
    replace(causes, registrations=registrations).save(paths["causes"])
    groups = {name: random.random((n, WIDTHS[name])) for name in GROUPS}
    names = {"sample": registrations.sample, "split": registrations.split}
    Descriptors(**names, **groups, axes=axes).save(paths["descriptors"])
    declared = Reenactments.array_fields()
    shapes = {name: [{"S": n, "K": 2}.get(size, size) for size in declared[name].shape] for name in declared}
    arrays = {name: random.random(shape) for name, shape in shapes.items()}
    verdict = {"verdict": random.dirichlet(np.ones(4), size=n)}
    Reenactments(**arrays | names | verdict, axes=axes).save(paths["reenactments"])
    paths["diagnoses"] = folder / "diagnoses" / source / "gpca" / f"seed{seed}.csv"
    attribution = Attribution.of_scores(LABELS, random.dirichlet(np.ones(4), size=n), seconds=0.0)
    write_predictions(paths["diagnoses"], registrations, attribution)
    return paths


@pytest.fixture(scope="module")
def causes(four):
    """So many training samples that those of each family have two labels."""
    return draw_causes(four, "four", 100, CauseSettings(**FEW_CAUSES | {"train": 16}))[0]


@pytest.fixture(scope="module")
def files(causes, tmp_path_factory):
    """The job's files: those of every source and seed, and three of frames, whose place test samples take."""
    folder, random = tmp_path_factory.mktemp("guarantee"), np.random.default_rng(0)
    of_axes = [write_measurements(folder, causes, axes, random) for axes in AXES]
    given = {name: [paths[name] for paths in of_axes] for name in of_axes[0]}
    frames = causes.subset(causes.rows("test"))
    frames = replace(frames, registrations=replace(frames.registrations, axes=("real_rgbd", 100)))
    given |= {name: [folder / name / f"seed100.{kind}"] for name, kind in FRAMES.items()}
    frames.save(given["frame_causes"][0])
    numbers = frames.registrations.sample
    samples = {"sample": numbers, "instance": numbers // 2, "truth": "annotated"}
    write_csv(given["frame_samples"][0], pd.DataFrame(samples))
    attribution = Attribution.of_scores(LABELS, random.dirichlet(np.ones(4), size=len(frames)), seconds=0.0)
    said = prediction_frame(frames.registrations, attribution).assign(explainer="gpca")
    write_csv(given["frame_predictions"][0], said)
    return given | {"scores": [folder / "guarantee" / f"{name}.csv" for name in EXPLAINERS]}


FRAMES = {"frame_causes": "npz", "frame_samples": "csv", "frame_predictions": "csv"}


@pytest.fixture(scope="module")
def scored(files):
    step.run(Job(settings={"explainers": EXPLAINERS}, **files))
    return {path.stem: Scored.load(path) for path in files["scores"]}


def test_models_learn_from_one_part_and_score_everything(scored, files, causes):
    labeled = int((states_of(causes.truth) != BORDERLINE).sum())
    of_explainer = scored["pair_forest"]
    models = sorted(set(of_explainer.model.tolist()))
    assert len(models) > 1 and all(model.startswith("part") for model in models)
    assert len(of_explainer) == labeled * len(AXES) * len(models)
    for model in models:
        of_model = of_explainer.model == model
        learned = set(of_explainer.family[of_model & of_explainer.seen].tolist())
        asked = set(of_explainer.family[of_model & ~of_explainer.seen].tolist())
        assert learned and asked and not learned & asked


def test_what_learns_nothing_is_one_model_that_no_sample_taught(scored, causes):
    labeled = int((states_of(causes.truth) != BORDERLINE).sum())
    assert set(scored["reenact"].model.tolist()) == {"untrained"} and not scored["reenact"].seen.any()
    assert len(scored["reenact"]) == labeled * len(AXES)


def test_models_of_embeddings_are_asked_as_they_are(scored):
    of_explainer = scored["gpca"]
    assert set(of_explainer.model.tolist()) == {"seed 100", "seed 101", "frames 100"}
    as_is = of_explainer.subset(np.char.startswith(of_explainer.model, "seed"))
    assert as_is.seen.tolist() == [name.startswith("train") for name in as_is.sample]


def test_frames_are_beside_the_test_samples_that_they_are_calibrated_on(scored, causes):
    of_frames = scored["gpca"].subset(scored["gpca"].model == "frames 100")
    real = of_frames.subset(of_frames.source == "real_rgbd")
    simulated = of_frames.subset(of_frames.source != "real_rgbd")
    assert len(real) and len(simulated) == 2 * len(real)
    assert set(simulated.seed.tolist()) == {100} and not simulated.seen.any()
    assert set(real.weight.tolist()) <= {0.5, 1.0} and set(simulated.weight.tolist()) == {1.0}


def test_files_of_other_samples_or_kinds_are_one_line(files):
    of_axes = {"causes_files": files["causes"]} | {name: files[name] for name in ("descriptors", "reenactments")}
    with pytest.raises(InputError, match="array 'distances' is missing"):
        read_pool(**{**of_axes, "descriptors": of_axes["reenactments"]})
    with pytest.raises(InputError, match="of source 'tools', seed 101"):
        read_pool(**{**of_axes, "descriptors": of_axes["descriptors"][::-1]})


def test_frames_of_other_samples_are_one_line(files, tmp_path):
    _, pool = read_pool(files["causes"], files["descriptors"], files["reenactments"])
    as_is = list(step.scored_as_is(pool, files["diagnoses"]))
    frames = [files[name][0] for name in FRAMES]
    rows = pd.read_csv(frames[1])
    write_csv(tmp_path / "others.csv", rows.assign(sample=rows["sample"] + 50))
    with pytest.raises(InputError, match="its samples differ from those of the causes of frames"):
        list(step.scored_on_frames([(frames[0], tmp_path / "others.csv", frames[2])], "gpca", as_is))


def test_families_of_one_fold_are_one_part_wherever_they_are_and_others_are_dealt_out():
    family = np.array(["can", "can", "box", "cup", "bowl", "pen", "vise"])
    parts = parts_of(family, np.array([2, -1, 0, -1, -1, -1, -1]))
    assert parts[:3].tolist() == [2, 2, 0]
    assert set(np.bincount(parts[3:], minlength=3)) == {1, 2}
    assert np.array_equal(parts_of(family[::-1], np.array([-1, -1, -1, -1, 0, -1, 2])), parts[::-1])


def test_the_pool_has_no_borderline_sample(files, causes):
    registrations, samples = read_pool(files["causes"], files["descriptors"], files["reenactments"])
    assert BORDERLINE not in samples.state and set(registrations.concept) <= set(LABELS)
    assert (samples.severity > 0).all() and (samples.severity <= 1).all()
    assert {"verdict", "reenactment", *GROUPS} <= set(registrations.attached)
