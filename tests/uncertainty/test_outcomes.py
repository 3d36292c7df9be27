import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.uncertainty.outcomes import Outcomes, read_seconds, write_seconds

COLUMNS = tuple(Outcomes.array_fields())
S, K = 6, 4
CONDITIONS = ("none", "noise", "pose+noise", "x")


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


def test_the_table_has_a_column_for_every_condition(tmp_path):
    outcomes = made()
    outcomes.write_table(tmp_path / "seed0.csv", CONDITIONS)
    rows = pd.read_csv(tmp_path / "seed0.csv")
    assert list(rows.columns) == ["sample", "split", *(f"uncertainty_{c}" for c in CONDITIONS)]
    assert rows["sample"].tolist() == outcomes.sample.tolist() and rows["split"].tolist() == outcomes.split.tolist()
    assert np.allclose(rows.filter(like="uncertainty_"), outcomes.uncertainty, atol=5.1e-7)


def test_what_is_attached_belongs_to_the_sample(registrations):
    rows = np.array([50, 3, 36, 0, 17, 37, 36 - 1])  # of both splits, in an order of their own
    outcomes = made(registrations.sample[rows], registrations.split[rows])
    seconds, icp_seconds = seconds_of(outcomes)
    shuffled = registrations.subset(np.random.default_rng(0).permutation(len(registrations)))
    for given in (registrations, shuffled):
        attached = outcomes.attach_to(given, seconds, icp_seconds)
        assert attached.sample.tolist() == outcomes.sample.tolist()
        assert attached.split.tolist() == outcomes.split.tolist()
        for i, row in enumerate(rows):
            assert np.array_equal(attached.cloud(i), registrations.cloud(row))
            assert np.array_equal(attached.target(i), registrations.target(row))
            assert attached.concept[i] == registrations.concept[row]
            assert np.array_equal(attached.T_target_source_icp[i], registrations.T_target_source_icp[row])
        expected = vars(outcomes) | {"seconds": seconds, "icp_seconds": icp_seconds}
        for name in (*COLUMNS[2:], "seconds", "icp_seconds"):
            assert np.array_equal(attached.attached[name], expected[name])


@pytest.mark.parametrize(("sample", "split"), [(99, "test"), (20, "test"), (0, "validate")])
def test_samples_that_the_registrations_lack_are_refused(registrations, sample, split):
    """Sample 20 is one of the training split only."""
    outcomes = made([0, sample], ("test", split))
    with pytest.raises(InputError, match="samples that the registrations lack; regenerate both"):
        outcomes.attach_to(registrations, *seconds_of(outcomes))


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
        (lambda rows: rows.assign(seconds="soon"), "'seconds' contains values that are not finite numbers"),
        (lambda rows: rows[:-1], "its samples differ from those of the outcomes"),
        (lambda rows: rows.assign(split="test"), "its samples differ from those of the outcomes"),
    ],
)
def test_faulty_seconds_are_refused(tmp_path, damage, expected):
    path = tmp_path / "seed0.csv"
    outcomes = made()
    write_seconds(path, outcomes, *seconds_of(outcomes))
    damage(pd.read_csv(path)).to_csv(path, index=False)
    with pytest.raises(InputError, match=expected):
        read_seconds(path, outcomes)
