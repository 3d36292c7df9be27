"""Step ``ship``: a run's model -> the same one as it comes with the package, and its card; for releases."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from tempfile import TemporaryDirectory

from gpca.commands.card import card
from gpca.errors import InputError
from gpca.experiments.diagnosis.metrics import read_intervals
from gpca.io.files import require_outputs, whole_file
from gpca.model.file import Model
from gpca.model.origin import Origin

LARGEST_BYTES = 5 * 10**6  # of a file that every installation carries


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files; there are no settings."""
    parser.add_argument(
        "--model", required=True, type=Path, help="model in the folder of its run, such as results/real/model.pt"
    )
    parser.add_argument("--out", required=True, type=Path, help="the model to ship, such as gpca/model/shipped.pt")
    parser.add_argument("--card", required=True, type=Path, help="its card, such as gpca/model/shipped.md")


def run(options: Namespace) -> None:
    """Write both, or neither; the same run gives the same bytes."""
    if options.settings:
        raise InputError("--settings", "is not used by ship", "make another model to change its settings")
    scores = options.model.with_name("cause_intervals.csv")
    require_outputs([options.out, options.card], [options.model, scores])
    model = Model.load(options.model)
    if model.diagnoser is None:
        raise InputError(options.model, "cannot say what is wrong with a registration", "ship one with a diagnoser")
    if model.stand_in:
        raise InputError(options.model, "was trained on objects that the package drew", "ship a model of real objects")
    with TemporaryDirectory() as folder:
        written = Path(folder) / "model.pt"
        model.save(written)
        content = written.read_bytes()
    if len(content) > LARGEST_BYTES:
        found = f"has {len(content) / 1e6:.1f} MB, more than the {LARGEST_BYTES / 1e6:g} MB allowed in the package"
        raise InputError(options.model, found, "lower causes.train, causes.test or real_world.train")
    origin = Origin.of(options.model, model.title)
    text = card(options.out.name, content, model, model.diagnoser, origin, read_intervals(scores))
    with whole_file(options.out) as partial:
        partial.write_bytes(content)
    with whole_file(options.card) as partial:
        partial.write_text(text, encoding="utf-8")
