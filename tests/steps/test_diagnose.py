"""The steps ``describe``, ``train_on_causes`` and ``diagnose`` by hand: what they say of faulty files and settings."""

import pytest

from gpca.attribution.predictions import read_predictions
from gpca.causes.labels import LABELS

from ..hostile import refusal
from .command_lines import STEP_OPTIONS, arguments, arrays_changed, lines_kept, truncated, untouched

FAULTS = {
    "describe": [
        (untouched, {"--causes": "registrations.npz"}, "registrations.npz: array"),
        (truncated("causes.npz"), {}, "causes.npz: is not a readable npz archive"),
        (lines_kept("causes_timings.csv", 3), {}, "causes_timings.csv: does not contain the times of these samples"),
        (untouched, {"--descriptors": "causes.npz"}, "causes.npz"),
    ],
    "train_on_causes": [
        (untouched, {"--causes": "registrations.npz"}, "registrations.npz: array"),
        (lines_kept("causes_timings.csv", 3), {}, "causes_timings.csv: does not contain the times of these samples"),
        (untouched, {"--embeddings": "causes.npz"}, "causes.npz"),
    ],
    "diagnose": [
        (untouched, {"--read": "registrations.npz"}, "registrations.npz: array"),
        (arrays_changed("descriptors.npz", sample=lambda s: s[::-1]), {}, "descriptors.npz: its samples differ"),
        (arrays_changed("descriptors.npz", motion=lambda m: m * float("nan")), {}, "array 'motion' contains NaN"),
        (untouched, {"--explainer": "gpca", "--read": "descriptors.npz"}, "descriptors.npz: array 'h' is missing"),
        (untouched, {"--predictions": "causes.npz"}, "causes.npz"),
    ],
}


@pytest.mark.parametrize(("step", "fault"), [(step, i) for step in FAULTS for i in range(len(FAULTS[step]))])
def test_a_fault_is_one_line_and_harms_nothing(folder, step, fault):
    spoil, changes, words = FAULTS[step][fault]
    spoil(folder)
    refusal(arguments(step, changes), folder, words)


def test_a_diagnosis_scores_nominal_and_the_causes_of_every_sample(made):
    rows = read_predictions(made / STEP_OPTIONS["diagnose"]["--predictions"])
    assert [name for name in rows.columns if name.startswith("score_")] == [f"score_{label}" for label in LABELS]
    assert set(rows["split"]) == {"train", "test"}
