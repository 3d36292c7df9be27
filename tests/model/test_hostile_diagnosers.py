"""Model files whose diagnoser holds what cannot be."""

import pytest

from gpca.errors import InputError
from gpca.model.file import Model

from .spoiled import HUGE, NAN, indefinite, put, spoil

CONTENTS = {
    "a threshold of failure of NaN": put("diagnoser/threshold", NAN),
    "a threshold of text": put("diagnoser/threshold", "0.5"),
    "errors of other descriptors": put("diagnoser/error_weights", lambda w: w[:-1]),
    "quantiles of other descriptors": put("diagnoser/classifier/quantiles", lambda q: q[:, :-1]),
    "quantiles that fall": put("diagnoser/classifier/quantiles", lambda q: q.flip(0)),
    "1e9 starts": put("diagnoser/runs/starts", HUGE),
    "starts of text": put("diagnoser/runs/starts", "many"),
    "1e9 restarts": put("diagnoser/descriptors/restarts", HUGE),
    "an angle of NaN": put("diagnoser/descriptors/restart_rotation_deg", NAN),
    "1e9 points of a description": put("diagnoser/points", HUGE),
    "a cause without a classifier": put("diagnoser/classifier/causes", lambda causes: causes[:2]),
    "three states": put("diagnoser/classifier/failure/classes", ["nominal", "failed", "odd"]),
    "states in another order": put("diagnoser/classifier/failure/classes", ["failed", "nominal"]),
    "other states": put("diagnoser/classifier/failure/classes", ["yes", "no"]),
    "a cause of other classes": lambda content: content["diagnoser"]["classifier"]["causes"][1].update(
        classes=["present", "absent"]
    ),
    "a covariance that is not positive definite": put("diagnoser/classifier/failure/covariance", indefinite),
    "a diagnoser of nothing": put("diagnoser", {}),
    "a diagnoser of text": put("diagnoser", "magic"),
}  # fmt: skip


@pytest.mark.parametrize("fault", CONTENTS)
def test_a_model_whose_diagnoser_cannot_be_is_not_loaded(fault, folder):
    spoil(folder / "model.pt", CONTENTS[fault])
    with pytest.raises(InputError, match=r"model\.pt: is .*; make one with"):
        Model.load(folder / "model.pt")
