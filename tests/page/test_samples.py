import json
from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, BY_SIZE
from gpca.errors import InputError
from gpca.page.samples import POINTS, cause_samples, first_of_each_cause
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import transform
from tests.conftest import FEW_CAUSES

from ..model.test_page import unpacked

MEASURED = {"title": "Four", "stand_in": True}
SETTINGS = CauseSettings(**FEW_CAUSES)


@pytest.fixture(scope="module")
def measured(four, causes, tmp_path_factory):
    """The objects of the source, and its causes of seed 100."""
    folder = tmp_path_factory.mktemp("measured")
    causes_npz, objects = folder / "causes/four/seed100.npz", folder / "objects/four.npz"
    replace(causes, registrations=replace(causes.registrations, axes=("four", 100))).save(causes_npz)
    four.save(objects, "four")
    return {"objects": objects, "causes": causes_npz}


@pytest.fixture(scope="module")
def shown(measured):
    return cause_samples(measured, MEASURED, SETTINGS)


def test_the_first_failure_of_each_cause_is_shown_with_the_shares_and_errors_of_the_truth(shown, causes):
    rows = first_of_each_cause(causes)
    assert 0 < len(rows) <= len(CONCEPTS)
    assert set(causes.registrations.split[rows]) == {"test"}
    assert set(causes.truth.state[rows]) == {"failed"}
    assert (causes.error_shown[rows] > causes.truth.failed_limit).all()
    assert [sample["concept"] for sample in shown] == causes.truth.dominant[rows].tolist()
    assert len({sample["concept"] for sample in shown}) == len(shown)
    assert first_of_each_cause(causes.subset(causes.rows("train"))) == []
    for sample, row in zip(shown, first_of_each_cause(causes), strict=True):
        assert [share["percent"] for share in sample["shares"]] == pytest.approx(100 * causes.truth.phi[row], abs=0.01)
        errors = 100 * causes.truth.error[row, list(BY_SIZE)]
        assert [what_if["percent"] for what_if in sample["what_ifs"]] == pytest.approx(errors, abs=0.01)
        assert sample["what_ifs"][-1]["words"] == "As it was"
        assert sample["limit"] == 100 * SETTINGS.limits.failed
        assert json.loads(json.dumps(sample)) == sample


def test_every_counterfactual_can_be_seen(shown, causes):
    for sample, row in zip(shown, first_of_each_cause(causes), strict=True):
        scene = sample["scene"]
        [pose] = scene["poses"]
        assert len(unpacked(scene["source"])) <= POINTS
        clouds = [pose["what_ifs"][each] if isinstance(each, int) else each for each in pose["what_ifs"]]
        assert len(clouds) == 8
        assert set(scene["titles"]) == {"pose:0", *(f"what:0:{place}" for place in range(8))}
        found = transform(np.reshape(scene["found"], (4, 4)), unpacked(scene["source"]))
        np.testing.assert_allclose(unpacked(clouds[BY_SIZE.index(ALL)]), found, atol=2e-3)
        distinct = 2 ** int(causes.applied[row].sum())
        assert sum(not isinstance(each, int) for each in pose["what_ifs"]) <= distinct


def test_causes_of_other_settings_are_refused(measured):
    with pytest.raises(InputError, match="is not reproduced by these settings"):
        cause_samples(measured, MEASURED, CauseSettings(**FEW_CAUSES | {"points": (64, 128)}))
