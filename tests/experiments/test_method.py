"""Figures 2 and 3."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from gpca.causes.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.experiments.method import choose_samples, decide, fig2_overview, fig3_concepts
from gpca.experiments.registration_stages import Staged, source_before_icp
from gpca.io.arrays import save_arrays
from gpca.objects.canonical import DRAWN
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, SEVERITIES, SEVERITIES_OF, Severities
from gpca.rigid import scale_translation, transform
from tests.figures import assert_words_are_large_enough_and_inside, words_of

from .runs import SOLIDS

DIAMETERS_M = np.array([0.2, 0.5])
NAMES = np.array(["block", "bar"])
BOXES = Run({"figures": {"source": "boxes"}, "sources": {"boxes": {"title": "Boxes", "kind": "bop"}}})


def rigid(rotvec, translation):
    T = np.eye(4)
    T[:3, :3] = trimesh.transformations.rotation_matrix(np.linalg.norm(rotvec), rotvec)[:3, :3]
    T[:3, 3] = translation
    return T


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """An objects and a registrations file, 12 test samples of each object; also the sources before ICP."""
    # Points of two boxes, relative to their diameters.
    boxes = [trimesh.creation.box(extents) for extents in ((3, 2, 1), (6, 1, 1))]
    clouds = [np.asarray(box.sample(2000, seed=1)) / np.linalg.norm(box.extents) for box in boxes]
    folder = tmp_path_factory.mktemp("concepts")
    random = np.random.default_rng(5)
    points_m = np.concatenate([cloud * d for cloud, d in zip(clouds, DIAMETERS_M, strict=True)]).astype(np.float32)
    save_arrays(
        folder / "objects.npz",
        {"names": NAMES, "points_m": points_m, "normals": np.full_like(points_m, 3**-0.5)}
        | {"offsets": np.array([0, 2000, 4000]), "diameters_m": DIAMETERS_M}
        | {"families": NAMES, "folds": np.array([-1, -1])},
    )
    T_init, T_icp = rigid([0.1, 0, 0.2], [0.01, 0, 0.03]), rigid([0, 0.7, 0.1], [0, 0.1, 0])
    sources, aligned, severities, labels = [], [], [], []
    for sample in range(24):
        concept, row = CONCEPTS[sample % 3], sample // 3 % 2
        perturbed = PERTURBATIONS[concept](clouds[row][:500], Severities(), random)
        severities.append([perturbed.severity.get(n, 0.0) for n in SEVERITIES])
        labels.append((concept, row))
        to_diameters = 1 / DIAMETERS_M[row]
        sources.append(transform(scale_translation(T_init, to_diameters), perturbed.points))
        aligned.append(transform(scale_translation(T_icp, to_diameters), perturbed.points).astype(np.float32))
    concepts, rows = (np.array(column) for column in zip(*labels, strict=True))
    noise, rotation, translation, crop = np.array(severities).T
    registrations = Registrations(
        sample=np.arange(24),
        split=np.array(["test"] * 24),
        concept=concepts,
        object_index=rows,
        object_name=NAMES[rows],
        diameter_m=DIAMETERS_M[rows],
        cluster=NAMES[rows],
        fold=np.full(24, DRAWN),
        points=np.concatenate(aligned),
        offsets=np.cumsum([0, *map(len, aligned)]),
        target_points=np.concatenate(aligned),
        target_offsets=np.cumsum([0, *map(len, aligned)]),
        severity_noise=noise,
        severity_rotation_rad=rotation,
        severity_translation=translation,
        severity_crop=crop,
        T_target_source_true=np.tile(np.eye(4), (24, 1, 1)),
        T_target_source_init=np.tile(T_init, (24, 1, 1)),
        T_target_source_icp=np.tile(T_icp, (24, 1, 1)),
        fitness=np.ones(24),
        inlier_rmse=np.zeros(24),
        axes=("bricks", 0),
    )
    registrations.save(folder / "registrations.npz")
    return folder, registrations, sources


def test_source_before_icp_undoes_icp_in_the_right_units(files):
    _, registrations, sources = files
    for sample in (0, 4):  # one of each object, as their diameters differ
        np.testing.assert_allclose(source_before_icp(registrations, sample), sources[sample], atol=1e-6)


def test_samples_are_of_one_object_with_all_concepts_and_of_medium_severity(files):
    _, registrations, _ = files
    samples = choose_samples(registrations, "registrations.npz")
    assert {registrations.concept[sample] for sample in samples.values()} == set(CONCEPTS)
    assert len({registrations.object_name[sample] for sample in samples.values()}) == 1
    for concept, sample in samples.items():
        for name in SEVERITIES_OF[concept]:
            severity_S = getattr(registrations, f"severity_{name}")
            drawn = np.sort(severity_S[registrations.concept == concept])
            assert drawn[0] < severity_S[sample] < drawn[-1]
    bars = registrations.subset(np.flatnonzero(registrations.object_name == "bar"))
    assert {bars.object_name[sample] for sample in choose_samples(bars, "registrations.npz").values()} == {"bar"}
    with pytest.raises(InputError, match=r"r\.npz.*any object"):
        choose_samples(registrations.subset(np.flatnonzero(registrations.concept != "pose")), "r.npz")


def test_draws_red_and_blue_in_three_panels_and_the_same_bytes_again(files, same_bytes):
    folder, _, _ = files
    paths = folder / "objects.npz", folder / "registrations.npz"
    image = same_bytes(lambda: fig3_concepts(BOXES, *paths))[..., :3] / 255
    head = image.shape[0] // 6
    red, blue = image[head:, :, 0] - image[head:, :, 2], image[head:, :, 2] - image[head:, :, 0]
    for color in (red, blue):
        panels = np.array_split(color > 0.3, 3, axis=1)
        assert all(panel.sum() > 100 for panel in panels)


TREATMENTS = {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"}
THRESHOLDS = {"uncertain": None, "queued_share": 0.05, "dominant": 0.4, "improvement": 0.3}


def overview(stage_files, treatments=TREATMENTS, thresholds=THRESHOLDS):
    *files, limits = stage_files
    recovery = {"treatments": treatments, "thresholds": thresholds}
    return fig2_overview(Run(SOLIDS | {"causes": {"limits": limits}, "recovery": recovery}), *files)


def test_the_numbers_are_those_of_the_files_and_the_bytes_the_same_again(stage_files, same_bytes):
    def draw():
        return overview(stage_files)

    same_bytes(draw)
    written = words_of(draw())
    stages = Staged.load(*stage_files)
    row = stages.choose("pose", stage_files[0])
    sample, of = stages.predictions.iloc[row], stages.registrations
    assert f"{sample['score_pose']:.2f}±0.12" in written
    assert f"{sample['score_noise']:.2f}±0.10" in written
    assert f"{sample['score_overlap']:.2f}±0.05" in written
    assert stages.u_S[row] > stages.u_clean
    assert "nats (clean: < 1.0)" in stages.words(row, "icp")
    assert f"aligned: {stages.words(row, 'icp')}" in written
    assert any(f"{100 * of.severity_translation[row]:.0f} % $d$" in words for words in written)
    assert f"Solids (procedural stand-in): {of.object_name[row]}" in written
    assert "Act on pose:\nReinitialize ICP" in written
    assert r"$\mathbf{h} \in \mathbb{R}^{12}$" in written


def test_the_branch_follows_from_what_gpca_knows_and_not_from_the_true_error(stage_files, monkeypatch):
    monkeypatch.setattr(Staged, "error", lambda self, row: 0.012)  # It did not fail, which GP-CA cannot know
    stages = Staged.load(*stage_files)
    row = stages.choose("pose", stage_files[0])
    policy = RecoveryPolicy(Thresholds(uncertain=1.0, dominant=0.4, improvement=0.3), TREATMENTS)
    assert decide(stages, row, policy).action == "reinitialize"
    assert decide(stages, row, RecoveryPolicy(Thresholds(uncertain=0.0), TREATMENTS)).action == QUEUE
    assert decide(replace(stages, u_clean=np.inf), row, policy).action == NOTHING


def test_the_threshold_of_bald_is_named_and_no_letter_is_smaller_than_7_pt_or_outside(stage_files):
    figure = overview(stage_files, thresholds=THRESHOLDS | {"uncertain": 0.25})
    assert "BALD: ask above 0.25 nats" in words_of(figure)
    lines = [line.get_xdata()[0] for panel in figure.axes for line in panel.get_lines()]
    assert {0.25, 0.4} <= set(lines)
    figure = overview(stage_files)
    assert len(words_of(figure)) > 15
    assert_words_are_large_enough_and_inside(figure)
