"""The command ``gpca <step> …``, or ``python -m gpca <step> …``: the steps of the workflow, one at a time."""

from __future__ import annotations

import ctypes
import sys
from importlib import import_module
from pathlib import Path

from gpca import __version__
from gpca.errors import InputError
from gpca.experiments.registry import experiments
from gpca.process.arguments import THREADS, OneLineParser
from gpca.process.interrupts import certain_interrupts
from gpca.process.processor import prepare
from gpca.process.standard_streams import say, standard_streams

STEPS = {
    "objects": "meshes or clouds of a source -> canonical clouds",
    "registrations": "canonical clouds -> perturbed pairs aligned by ICP",
    "scenes": "settings -> table-top scenes of procedural objects, seen by a virtual depth camera",
    "instances": "depth frames with masks and poses -> partial clouds with initial poses",
    "frame_registrations": "partial clouds -> perturbed ones aligned by ICP",
    "register_methods": "registrations -> their test pairs registered by every method, with errors",
    "train": "registrations -> encoder weights",
    "embed": "registrations and encoder -> embeddings",
    "reduce": "embeddings -> embeddings of fewer dimensions by PCA, UMAP or an autoencoder",
    "uncertainty": "registrations -> Monte-Carlo ICP under the conditions of a design",
    "causes": "canonical clouds -> pairs with any subset of the causes, and each cause's share of the error",
    "describe": "causes -> measurements of each pair that need no ground truth",
    "train_on_causes": "causes -> encoder weights and embeddings of their aligned sources",
    "estimate": "causes -> covariances of the test registrations by every estimator, with errors",
    "diagnose": "causes, and descriptors or embeddings -> predictions of one explainer of causes",
    "frame_causes": "instances of depth frames -> why their registrations failed, and what explainers say about it",
    "attribute": "registrations, embeddings or uncertainty -> predictions of one explainer",
    "train_control": "registrations -> embeddings by an encoder that is trained under a control",
    "controls": "registrations and embeddings -> predictions of every explainer under every control",
    "without": "registrations -> embeddings by encoders that never saw one of the concepts",
    "active_learning": "embeddings -> learning curves of every acquisition strategy",
    "new_concepts": "registrations, causes and encoders -> learning curves of concepts that no encoder has seen",
    "frame_labels": "embeddings of depth frames -> learning curves of a new concept, by every backbone and by the pair",
    "kernel_grid": "embeddings -> scores of every kernel, learning rate and number of iterations",
    "shift": "registrations and encoder -> embedded samples that differ from the training samples, and their distances",
    "learners": "embeddings -> predictions of every learner, on test samples and on shifted ones",
    "readings": "files of a run -> the printed numbers under other readings of what the paper leaves unstated",
    "recover": "settings -> failures on virtual scenes, and what every recovery policy does about them",
    "label": "registrations and embeddings -> labels that a person gives when the classifier asks",
    "model": "encoder and embeddings -> one file with everything that an explanation needs",
    "ship": "model of a run -> the model that comes with the package, and its card",
    "explain": "files of points -> why their registration is uncertain, and what to do",
    "runtime": "model, registrations and embeddings -> seconds of every stage",
    "check-config": "configs -> whether a run can use them",
    "check-reference": "folder of a run -> whether its numbers agree with the reference",
}
EXPERIMENTS = {experiment.name: experiment for experiment in experiments() if experiment.summary}
STEPS |= {name: experiment.summary for name, experiment in EXPERIMENTS.items()}
_IN = "gpca.experiments."
MODULES = {
    **{name: experiment.step for name, experiment in EXPERIMENTS.items()},
    **{name: f"{_IN}{name}.step" for name in ("active_learning", "new_concepts", "frame_labels", "kernel_grid")},
    **{name: f"{_IN}{name}.step" for name in ("runtime", "frame_causes", "controls")},
    "recover": _IN + "recovery.step",
    "diagnose": _IN + "diagnosis.step",
    "register_methods": _IN + "registration_methods.step",
    "estimate": _IN + "estimators.step",
    "readings": _IN + "specification_curve.step",
    "shift": _IN + "out_of_distribution.shift_step",
    "learners": _IN + "out_of_distribution.learners_step",
    "train_control": _IN + "controls.train_step",
    "without": _IN + "active_learning.without_step",
    **{
        name: f"gpca.commands.{name.replace('-', '_')}"
        for name in ("explain", "ship", "label", "check-config", "check-reference")
    },
}


def main(arguments: list[str] | None = None) -> int:
    """Run one step; a user's mistake ends as one line on stderr and status 2, Ctrl-C as status 130.

    A step that checks something ends with status 1 where the check fails.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    chosen = next((argument for argument in arguments if not argument.startswith("-")), None)
    try:
        with certain_interrupts(), standard_streams():
            return _run(arguments, chosen)
    except (InputError, OSError) as fault:
        say(f"gpca {chosen}: {fault}")
        return 2
    except MemoryError:
        say(f"gpca {chosen}: this machine ran out of memory; use smaller settings or another machine")
        return 2
    except KeyboardInterrupt:
        print(f"gpca {chosen}: stopped; repeat the command to continue", file=sys.stderr)
        return 130


def _run(arguments: list[str], chosen: str | None) -> int:
    parser = OneLineParser(prog=_command(), description="The steps of the workflow, each of which can be run by hand.")
    parser.add_argument("--version", action="version", version=f"gpca {__version__}")
    steps = parser.add_subparsers(dest="step", required=True, metavar="step")
    for name, summary in STEPS.items():
        step = steps.add_parser(name, help=summary, description=summary)
        step.add_argument(
            "--threads", type=THREADS, default=1, help="number of threads for torch, numba and OpenMP (default 1)"
        )
        step.add_argument("--settings", default="{}", help="the step's section of the config, as JSON")
        if name == chosen:  # the others bring libraries that take seconds to load
            _set_threads(arguments)
            _keep_freed_memory()
            module = import_module(module_of(name))
            module.add_arguments(step)
            step.set_defaults(run=module.run)
    options = parser.parse_args(arguments)
    options.settings = _mapping(options.settings)
    return options.run(options) or 0


def module_of(step: str) -> str:
    """Return the module of a step."""
    return MODULES.get(step, f"gpca.steps.{step}")


def _command() -> str:
    """Return the command as the user called it."""
    return "gpca" if Path(sys.argv[0]).stem == "gpca" else "python -m gpca"


def _set_threads(arguments: list[str]) -> None:
    """Pin every library's threads and instructions before any of them is loaded."""
    early = OneLineParser(prog=_command(), add_help=False)
    early.add_argument("--threads", type=THREADS, default=1)
    prepare(early.parse_known_args(arguments)[0].threads)


def _keep_freed_memory() -> None:
    """Let glibc keep what is freed: else every large tensor's pages are faulted in anew, an eighth of training."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # absent outside glibc
    if mallopt is not None:
        trim_threshold, mmap_threshold = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h
        mallopt(trim_threshold, 2**31 - 1)
        mallopt(mmap_threshold, 2**30)


def _mapping(text: str) -> dict:
    from gpca.io.json_file import parse_json
    from gpca.io.structured_text import require_plain

    try:
        settings = parse_json(text)
    except ValueError as fault:
        raise InputError("--settings", f"invalid JSON: {fault}", "give a JSON object") from fault
    if not isinstance(settings, dict):
        raise InputError("--settings", "not a JSON object", 'give one, such as {"draw_points": 512}')
    require_plain(settings, "--settings")
    return settings


if __name__ == "__main__":
    sys.exit(main())
