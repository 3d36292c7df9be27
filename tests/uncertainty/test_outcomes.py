from dataclasses import fields, replace

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.uncertainty.outcomes import Outcomes, read_seconds, write_seconds

COLUMNS = tuple(field.name for field in fields(Outcomes))
S, K = 6, 4


def made(sample=range(S), split=("train",) * 2 + ("test",) * 4, seed=0):
    random = np.random.default_rng(seed)
    n = len(sample)
    return Outcomes(
        sample=np.array(sample),
        split=np.array(split),
        covariance=np.abs(random.normal(size=(n, K, 6, 6))),  # variances are not negative
        uncertainty=random.uniform(0, 9, size=(n, K)),
        residual=random.normal(size=(n, K)),
        degenerate=random.uniform(size=(n, K)) < 0.3,
        icp_calls=random.integers(50, size=(n, K)),
    )


def seconds_of(outcomes, seed=0):
    seconds = np.random.default_rng(seed).uniform(0.001, 2, size=outcomes.uncertainty.shape).round(6)
    return seconds, (0.9 * seconds).round(6)


# The npz


def test_outcomes_survive_the_file_and_give_the_same_bytes(tmp_path):
    outcomes = made()
    outcomes.save(tmp_path / "deep" / "a.npz", ("tiny", 0))
    loaded = Outcomes.load(tmp_path / "deep" / "a.npz")
    for name in COLUMNS:
        assert getattr(loaded, name).dtype == getattr(outcomes, name).dtype
        assert np.array_equal(getattr(loaded, name), getattr(outcomes, name))
    loaded.save(tmp_path / "b.npz", ("tiny", 0))
    made(seed=1).save(tmp_path / "c.npz", ("tiny", 0))
    first, again, other = ((tmp_path / name).read_bytes() for name in ("deep/a.npz", "b.npz", "c.npz"))
    assert first == again != other


def changed(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("name", "damage", "expected"),
    [
        *((name, lambda a: None, f"'{name}' is missing") for name in COLUMNS),
        ("uncertainty", lambda a: changed(a, (2, 1), np.nan), "'uncertainty' contains NaN"),
        ("covariance", lambda a: changed(a, (0, 0, 0, 0), np.inf), "'covariance' contains NaN or infinity"),
        ("residual", lambda a: changed(a, 0, -np.inf), "'residual' contains NaN or infinity"),
        ("covariance", lambda a: a[..., :5], "'covariance' is 6×4×6×5, not 6×4×6×6"),
        ("covariance", lambda a: a[:, 0], "'covariance' is 6×6×6, not 6×K×6×6"),
        ("uncertainty", lambda a: a[:, :-1], "'uncertainty' is 6×3, not 6×4"),
        ("residual", lambda a: a[:-1], "'residual' is 5×4, not 6×4"),
        ("degenerate", lambda a: a[:, 0], "'degenerate' is 6, not 6×4"),
        ("sample", lambda a: a[:-1], "is .*6.*, not .*5"),
        ("split", lambda a: a.astype(object), "pickled"),
    ],
)
def test_faulty_files_are_refused_in_one_line_with_their_name(tmp_path, name, damage, expected):
    path = tmp_path / "seed0.npz"
    arrays = {column: getattr(made(), column) for column in COLUMNS}
    arrays[name] = damage(arrays[name])
    np.savez(path, **{key: array for key, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=expected) as caught:
        Outcomes.load(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    assert "python -m gpca uncertainty" in str(caught.value)


def test_a_missing_file_names_the_step_that_makes_it(tmp_path):
    with pytest.raises(InputError, match="no such file; make it with 'python -m gpca uncertainty'"):
        Outcomes.load(tmp_path / "nowhere.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_file_is_refused(tmp_path, share):
    path = tmp_path / "seed0.npz"
    made().save(path, ("tiny", 0))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match="not a readable npz" if share else "is empty"):
        Outcomes.load(path)


def test_a_file_of_no_samples_is_refused(tmp_path):
    made([], np.array([], "U5")).save(tmp_path / "seed0.npz", ("tiny", 0))
    with pytest.raises(InputError, match="has no samples"):
        Outcomes.load(tmp_path / "seed0.npz")


def test_the_table_has_a_column_for_every_condition(tmp_path):
    outcomes = made()
    outcomes.write_table(tmp_path / "seed0.csv", ("none", "noise", "pose+noise", "x"))
    rows = pd.read_csv(tmp_path / "seed0.csv")
    assert list(rows.columns) == [
        "sample",
        "split",
        *(f"uncertainty_{c}" for c in ("none", "noise", "pose+noise", "x")),
    ]
    assert rows["sample"].tolist() == outcomes.sample.tolist() and rows["split"].tolist() == outcomes.split.tolist()
    assert np.allclose(rows.filter(like="uncertainty_"), outcomes.uncertainty, atol=5.1e-7)


# Attaching


@pytest.fixture()
def of_registrations(registrations):
    """Outcomes of some registrations of both splits, in an order of their own, and their seconds."""
    rows = np.array([50, 3, 36, 0, 17, 37, 36 - 1])
    outcomes = made(registrations.sample[rows], registrations.split[rows])
    return rows, outcomes, *seconds_of(outcomes)


def test_what_is_attached_belongs_to_the_sample(registrations, of_registrations):
    rows, outcomes, seconds, icp_seconds = of_registrations
    shuffled = registrations.subset(np.random.default_rng(0).permutation(len(registrations)))
    for given in (registrations, shuffled):
        attached = outcomes.attach_to(given, seconds, icp_seconds)
        assert (
            attached.sample.tolist() == outcomes.sample.tolist() and attached.split.tolist() == outcomes.split.tolist()
        )
        for i, row in enumerate(rows):
            assert np.array_equal(attached.cloud(i), registrations.cloud(row))
            assert np.array_equal(attached.target(i), registrations.target(row))
            assert attached.concept[i] == registrations.concept[row]
            assert np.array_equal(attached.T_target_source_icp[i], registrations.T_target_source_icp[row])
        for name in ("covariance", "uncertainty", "residual", "degenerate", "icp_calls"):
            assert np.array_equal(attached.attached[name], getattr(outcomes, name))
        assert np.array_equal(attached.attached["seconds"], seconds)
        assert np.array_equal(attached.attached["icp_seconds"], icp_seconds)


def test_what_was_attached_before_stays_with_its_rows(registrations, of_registrations):
    rows, outcomes, seconds, icp_seconds = of_registrations
    embedding = np.arange(2.0 * len(registrations)).reshape(-1, 2)
    given = replace(registrations, attached={"embedding": embedding})
    attached = outcomes.attach_to(given, seconds, icp_seconds)
    assert np.array_equal(attached.embedding, embedding[rows])
    assert np.array_equal(attached.attached["uncertainty"], outcomes.uncertainty)
    assert set(given.attached) == {"embedding"}


def test_outcomes_survive_file_and_attaching_together(tmp_path, registrations, of_registrations):
    rows, outcomes, seconds, icp_seconds = of_registrations
    outcomes.save(tmp_path / "seed0.npz", ("tiny", 0))
    write_seconds(tmp_path / "seed0.csv", outcomes, seconds, icp_seconds)
    loaded = Outcomes.load(tmp_path / "seed0.npz")
    attached = loaded.attach_to(registrations, *read_seconds(tmp_path / "seed0.csv", loaded))
    assert attached.object_name.tolist() == registrations.object_name[rows].tolist()
    assert np.array_equal(attached.attached["seconds"], seconds)


@pytest.mark.parametrize(("sample", "split"), [(99, "test"), (20, "test"), (0, "validate")])
def test_samples_that_the_registrations_lack_are_refused(registrations, sample, split):
    """Sample 20 is one of the training split only."""
    outcomes = made([0, sample], ("test", split))
    with pytest.raises(InputError, match="samples that the registrations lack; regenerate both"):
        outcomes.attach_to(registrations, *seconds_of(outcomes))


# The seconds


def test_seconds_survive_the_file(tmp_path):
    outcomes = made()
    seconds, icp_seconds = seconds_of(outcomes)
    write_seconds(tmp_path / "seed0.csv", outcomes, seconds, icp_seconds)
    read = read_seconds(tmp_path / "seed0.csv", outcomes)
    assert np.array_equal(read[0], seconds) and np.array_equal(read[1], icp_seconds)
    rows = pd.read_csv(tmp_path / "seed0.csv")
    assert list(rows.columns) == ["sample", "split", "condition", "seconds", "icp_seconds"]
    assert len(rows) == S * K
    one = rows[(rows["sample"] == 3) & (rows["condition"] == 2)]
    assert one["seconds"].tolist() == [seconds[3, 2]] and one["split"].tolist() == ["test"]


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (lambda rows: rows.drop(columns="icp_seconds"), "column 'icp_seconds' is missing"),
        (lambda rows: rows.drop(columns="condition"), "column 'condition' is missing"),
        (lambda rows: rows[:-1], "has 23 rows, not 6 samples × 4 conditions"),
        (lambda rows: rows[:0], "has no rows"),
        (lambda rows: rows.assign(seconds="soon"), "'seconds' contains values that are not finite numbers"),
        (lambda rows: rows.assign(icp_seconds=np.inf), "'icp_seconds' contains values that are not finite numbers"),
        (lambda rows: rows.assign(sample="three"), "'sample' contains values that are not finite numbers"),
        (lambda rows: rows.assign(sample=rows["sample"] + 1), "samples or conditions differ"),
        (lambda rows: rows.assign(split="test"), "samples or conditions differ"),
        (lambda rows: rows[::-1], "samples or conditions differ"),
        (lambda rows: rows.assign(condition=rows["condition"].to_numpy()[::-1]), "samples or conditions differ"),
        (lambda rows: rows.sort_values(["condition", "sample"]), "samples or conditions differ"),
    ],
)
def test_faulty_seconds_are_refused_in_one_line_with_their_name(tmp_path, damage, expected):
    path = tmp_path / "seed0.csv"
    outcomes = made()
    write_seconds(path, outcomes, *seconds_of(outcomes))
    damage(pd.read_csv(path)).to_csv(path, index=False)
    with pytest.raises(InputError, match=expected) as caught:
        read_seconds(path, outcomes)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_missing_and_empty_files_of_seconds_are_refused(tmp_path):
    path = tmp_path / "seed0.csv"
    with pytest.raises(InputError, match="no such file"):
        read_seconds(path, made())
    path.write_text("")
    with pytest.raises(InputError, match="is empty"):
        read_seconds(path, made())
