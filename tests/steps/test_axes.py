"""Files of another source or seed: each step refuses them, though their shapes are the same."""

import re
from dataclasses import replace

import numpy as np
import pytest
import torch

from gpca.encoders.training import write_tensors
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations
from tests.steps.by_words import main

from .command_lines import OF_ANOTHER_SOURCE, STEP_OPTIONS, arguments
from .spoiling import refused

FREE = {  # what a user may take from anywhere
    ("shift", "--other-registrations"),
    ("label", "registrations.npz"),
    ("learning_curve", "--samples"),  # it learns from further samples of all sources
}
ELSEWHERE = ("elsewhere", 7)


def given_files():
    """Step and option of every file of arrays or weights that a step reads of an earlier one, and the file."""
    made = {value for options in OF_ANOTHER_SOURCE.values() for value in options.values()}
    for step, options in STEP_OPTIONS.items():
        for option, value in options.items():
            name = option if option.endswith(".npz") else value
            is_labeled = isinstance(name, str) and name.endswith((".npz", ".pt")) and name != "model.pt"
            if is_labeled and name in made and (step, option) not in FREE:
                yield step, option, name
        made |= {value for value in options.values() if isinstance(value, str)}


def relabeled(path, source, seed):
    """Say in a file that it is of another source and seed."""
    if path.suffix == ".pt":
        return write_tensors(path, torch.load(path, weights_only=True) | {"source": source, "seed": seed})
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files if name not in ("source", "seed")}
    return save_arrays(path, arrays, (source, seed if "seed" in np.load(path) else None))


def unlabelled(path):
    if path.suffix == ".pt":
        return write_tensors(path, torch.load(path, weights_only=True)["weights"])
    with np.load(path) as archive:
        return save_arrays(path, {name: archive[name] for name in archive.files if name not in ("source", "seed")})


@pytest.mark.parametrize(("step", "option", "name"), [*given_files()])
def test_a_file_of_another_source_or_seed_is_refused(folder, capsys, step, option, name):
    own = f"another/{name}"  # of another place, so that the step's other options still give the right file
    (folder / own).parent.mkdir(parents=True)
    (folder / own).write_bytes((folder / name).read_bytes())
    relabeled(folder / own, *ELSEWHERE)
    changes = {own: [], option: None} if option == name else {option: own}
    # Of two files that do not fit together, the step may name the other one.
    files = "|".join(re.escape(each) for each in (own, *map(str, STEP_OPTIONS[step].values())) if "." in each)
    message = (
        rf"({files}): is of source '(elsewhere|tiny)'.*, not of source '(elsewhere|tiny|other)'.*; give the file of"
    )
    refused(folder, capsys, step, lambda _: None, changes, message)


@pytest.mark.parametrize(
    ("step", "name", "fault"),
    [
        ("train", "registrations.npz", "array 'source' is missing; regenerate it with"),
        ("reduce", "embeddings.npz", "array 'source' is missing; regenerate it with Snakemake"),
        ("describe", "causes.npz", "array 'source' is missing"),
        ("embed", "weights.pt", "or damaged; regenerate them with"),
    ],
)
def test_a_file_of_ours_that_does_not_say_of_what_it_is_has_to_be_made_anew(folder, capsys, step, name, fault):
    refused(folder, capsys, step, lambda folder: unlabelled(folder / name), {}, f"{name}: .*{fault}")


def test_every_file_of_arrays_and_weights_says_of_what_it_is(made):
    for path in made.glob("*.npz"):
        with np.load(path) as archive:
            source = "other" if "other" in path.stem else "tiny"
            assert str(archive["source"]) == source, path
            assert "objects" in path.stem or int(archive["seed"]) == 0, path
    for path in (path for path in made.glob("*.pt") if path.stem != "model"):
        content = torch.load(path, weights_only=True)
        assert (content["source"], content["seed"]) == ("other" if path.stem == "other" else "tiny", 0)


def test_several_files_are_trained_on_together_where_each_has_its_source(folder, capsys):
    both = {"--registrations": ["registrations.npz", "other.npz"], "--source": "both", "--weights": "both.pt"}
    swapped = both | {"--registrations-of": ["other", "tiny"]}
    refused(folder, capsys, "train", lambda _: None, swapped, "registrations.npz: is of source 'tiny'")
    assert main(arguments("train", both | {"--registrations-of": ["tiny", "other"]})) == 0


def test_an_encoder_and_files_may_be_of_a_source_that_is_named(folder, capsys):
    """As under other initial poses, and where seeds are those of the classifier alone."""
    embed = {"--encoder": "other.pt", "--embeddings": "new.npz", "--timings": "new.csv"}
    refused(folder, capsys, "embed", lambda _: None, embed, "other.pt: is of source 'other', seed 0, not of")
    assert main(arguments("embed", embed | {"--encoder-of": "other"})) == 0
    attribute = {"--source": "same", "--seeds": 5, "--predictions": "new.csv", "--timings": "new_seconds.csv"}
    refused(folder, capsys, "attribute", lambda _: None, attribute, "is of source 'tiny', seed 0, not of")
    assert main(arguments("attribute", attribute | {"--files-of": "tiny", "--files-seed": 0})) == 0


def test_embeddings_of_registrations_are_compared_where_no_source_is_named(folder, capsys):
    registrations = replace(Registrations.load(folder / "registrations.npz"), axes=ELSEWHERE)
    refused(
        *(folder, capsys, "label", lambda folder: registrations.save(folder / "registrations.npz"), {}),
        "embeddings.npz: is of source 'tiny', seed 0, not of source 'elsewhere', seed 7",
    )
