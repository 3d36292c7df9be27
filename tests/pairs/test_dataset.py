import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment.icp import ICP, ICPSettings
from gpca.errors import InputError
from gpca.pairs import synthesis
from gpca.pairs.dataset import REGISTRATION_COLUMNS, Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import RegistrationSettings, make_registrations, read_as
from gpca.rigid import inverse, rotation_angle_rad, transform


def in_object_frame(registrations, row):
    """The cloud with ICP's pose and the perturbation's undone, in metres."""
    back = registrations.T_target_source_true[row] @ inverse(registrations.T_target_source_icp[row])
    return transform(back, registrations.cloud(row) * registrations.diameter_m[row])


def test_concepts_and_objects_are_balanced_in_both_splits(registrations):
    for split, per_cell in (("train", 4), ("test", 2)):
        rows = registrations.rows(split)
        cells = list(zip(registrations.concept[rows], registrations.object_name[rows], strict=True))
        assert {cell: cells.count(cell) for cell in cells} == {
            (concept, name): per_cell for concept in CONCEPTS for name in ("brick", "cone", "capsule")
        }


def test_a_sample_does_not_depend_on_how_many_there_are(objects, registrations):
    few, _ = make_registrations(objects, "tiny", 0, RegistrationSettings(train=6, test=3, cloud_points=256))
    for split, n in (("train", 6), ("test", 3)):
        one, other = few.subset(few.rows(split)), registrations.subset(registrations.rows(split)[:n])
        for name in {*REGISTRATION_COLUMNS, "points", "offsets"} - {"sample"}:
            assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_severities_are_recorded_for_the_concept_alone_and_hidden_without_labels(registrations):
    for name, concept in {"noise": "noise", "rotation_rad": "pose", "translation": "pose", "crop": "overlap"}.items():
        assert np.array_equal(getattr(registrations, f"severity_{name}") > 0, registrations.concept == concept)
    kept = np.diff(registrations.offsets)
    assert np.array_equal(kept, np.round(256 * (1 - registrations.severity_crop)).astype(int))
    angles = [rotation_angle_rad(T) for T in registrations.T_target_source_true]
    assert angles == pytest.approx(registrations.severity_rotation_rad, abs=1e-7)
    shifts = np.linalg.norm(registrations.T_target_source_true[:, :3, 3], axis=1) / registrations.diameter_m
    assert shifts == pytest.approx(registrations.severity_translation)
    blind = registrations.without_labels()
    assert set(blind.concept) == {""}
    for name in REGISTRATION_COLUMNS:
        if name.startswith("severity_") or name == "T_target_source_true":
            assert np.isnan(getattr(blind, name)).all()
    for name in ("points", "offsets", "T_target_source_icp", "fitness", "sample"):
        assert np.array_equal(getattr(blind, name), getattr(registrations, name))


def test_poses_undone_the_clean_points_lie_on_the_object(objects, registrations):
    for row in range(len(registrations)):
        tree = cKDTree(objects.points(registrations.object_index[row]))
        distance = tree.query(in_object_frame(registrations, row))[0] / registrations.diameter_m[row]
        if registrations.concept[row] == "noise":
            assert distance.mean() > 0.3 * registrations.severity_noise[row]
        else:
            assert distance.max() < 1e-6


def test_source_and_target_share_no_point_and_icp_gives_the_stored_cloud(objects, monkeypatch):
    seen = []

    class Recorded(ICP):
        def __init__(self, target, normals, settings):
            super().__init__(target, normals, settings)
            self.target = target

        def register(self, source, T_target_source_init):
            result = super().register(source, T_target_source_init)
            seen.append((self.target, source, T_target_source_init, result))
            return result

    monkeypatch.setattr(synthesis, "ICP", Recorded)
    settings = RegistrationSettings(train=6, test=6, cloud_points=2048)
    made, icp_seconds = make_registrations(objects, "tiny", 0, settings)
    assert (icp_seconds > 0).all()
    for row, (target, source, T_init, result) in enumerate(seen):
        assert len(target) == 300  # half of the object's 600 points, though 2048 were asked for
        clean = transform(made.T_target_source_true[row], source * made.diameter_m[row]) / made.diameter_m[row]
        assert cKDTree(target).query(clean)[0].min() > 1e-7
        assert np.array_equal(made.target(row), target.astype(np.float32))
        assert np.allclose(made.cloud(row), transform(result.T_target_source, source), atol=1e-6)
        in_metres = transform(made.T_target_source_icp[row], source * made.diameter_m[row]) / made.diameter_m[row]
        assert np.allclose(made.cloud(row), in_metres, atol=1e-6)
        assert np.array_equal(made.T_target_source_init[row], T_init)
        assert (made.fitness[row], made.inlier_rmse[row]) == (result.fitness, result.inlier_rmse)


def test_a_subset_keeps_every_rows_cloud_and_columns(registrations):
    embedding = np.arange(len(registrations))[:, None] * 1.0
    with_embedding = dataclasses.replace(registrations, attached={"embedding": embedding})
    rows = np.array([17, 2, 40, 2])
    chosen = with_embedding.subset(rows)
    assert len(chosen) == 4
    for new, old in enumerate(rows):
        assert np.array_equal(chosen.cloud(new), registrations.cloud(old))
        assert np.array_equal(chosen.target(new), registrations.target(old))
        assert chosen.embedding[new] == old
        for name in REGISTRATION_COLUMNS:
            assert np.array_equal(getattr(chosen, name)[new], getattr(registrations, name)[old])


def test_registrations_survive_the_file(tmp_path, registrations):
    registrations.save(tmp_path / "a.npz")
    loaded = Registrations.load(tmp_path / "a.npz")
    for name, array in registrations.arrays.items():
        assert getattr(loaded, name).dtype == array.dtype
        assert np.array_equal(getattr(loaded, name), array)
    loaded.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def changed(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("name", "damage", "expected"),
    [
        ("concept", lambda a: changed(a, 3, "dust"), "unknown concept 'dust'; expected one of noise, pose, overlap"),
        ("points", lambda a: a[:-1], "'offsets' do not match"),
        ("offsets", lambda a: a[:-1], "'offsets' is 54, not 55"),
        ("target_points", lambda a: a[:-1], "'target_offsets' do not match"),
        ("target_offsets", lambda a: a[:-1], "'target_offsets' is 54, not 55"),
        ("offsets", lambda a: changed(a, 1, a[2]), "fewer than 3 'points'"),
        ("offsets", lambda a: changed(a, 1, a[3]), "fewer than 3 'points'"),
    ],
)
def test_faulty_files_are_refused_with_their_name(tmp_path, registrations, name, damage, expected):
    path = tmp_path / "seed0.npz"
    arrays = registrations.arrays | {"source": np.array("tiny"), "seed": np.array(0)}
    arrays[name] = damage(arrays[name])
    np.savez(path, **{key: array for key, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=expected) as caught:
        Registrations.load(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_readings_are_before_icp_after_it_and_after_icp_from_the_model(registrations):
    few = registrations.subset(np.arange(3))
    assert read_as("aligned", few, ICPSettings()) is few
    observed, backwards = (read_as(name, few, ICPSettings()) for name in ("observed", "reversed"))
    for row in range(3):
        assert np.allclose(observed.cloud(row), few.source(row), atol=1e-5)
        assert np.allclose(observed.source(row), few.source(row), atol=1e-5)
        assert np.array_equal(observed.target(row), few.target(row))
        assert not np.array_equal(backwards.cloud(row), few.cloud(row))
    with pytest.raises(InputError, match="reading 'sideways': unknown; choose one of aligned, observed, reversed"):
        read_as("sideways", few, ICPSettings())
