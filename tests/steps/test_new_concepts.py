"""The step ``new_concepts`` by hand, and what it says of faulty files and settings."""

import pytest

from .by_words import main
from .command_lines import STEP_OPTIONS, arguments, arrays_changed, refused, removed, settings, truncated, untouched

OWN = STEP_OPTIONS["new_concepts"]["--settings"]


def changed(section, **keys):
    return settings("new_concepts", **{section: OWN[section] | keys})


FAULTS = [
    (removed("other.pt"), {}, r"other.pt: no such weights; regenerate them with Snakemake"),
    (truncated("cause_weights.pt"), {}, r"cause_weights.pt: not the weights of backbone 'dgcnn', or damaged"),
    (removed("causes.npz"), {}, r"causes.npz: no such file; make it with Snakemake"),
    (arrays_changed("cause_embeddings.npz", sample=lambda s: s + 1), {}, r"cause_embeddings.npz: its samples differ"),
    (arrays_changed("descriptors.npz", sample=lambda s: s + 1), {}, r"descriptors.npz: its samples differ from those"),
    (untouched, changed("new_concepts", erring=["other_samples"]), r"'other_samples' is not among the embeddings; cho"),
    (
        untouched,
        changed("active_learning", initial=18),
        r"leaves none of 18 training samples for the pool",
    ),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "new_concepts", *FAULTS[fault])


def test_what_cannot_be_tried_is_left_out_and_named(folder, capsys):
    assert main(arguments("new_concepts", {"--encoders": [], "--encoders-of": []})) == 0
    err = capsys.readouterr().err
    assert "new concepts of tiny: 'other_source' is skipped: it needs two sources or more" in err
    assert "'geometry' is skipped: none of 2 candidates of a split fails without a cause" in err
    settings_found = {line.split(",")[0] for line in (folder / "new_bald_kmeans.csv").read_text().splitlines()[1:]}
    assert settings_found == {"self_supervised", "pair", "pair_errors_50", "pretrained"}
