"""Steps and commands called with words, as tests write them: ``["train", "--seed", "0", …]``."""

import json
import os
import subprocess
import sys
from pathlib import Path

from gpca.__main__ import COMMANDS
from gpca.__main__ import main as command
from gpca.jobs.job import Job, as_process, call
from gpca.process.code_files import ROOT
from gpca.process.processor import THREAD_VARIABLES

STEPS = {  # module of gpca.steps -> the steps that it has, functions of their names; or name=function
    "active_learning": "active_learning=learn_actively without=embed_without frame_labels=learn_on_frames",
    "causes": "causes describe reenact train_on_causes model",
    "control_samples": "train_control=train",
    "controls": "controls=explain",
    "diagnosis": "diagnose diagnose_by_features diagnose_frames",
    "frames": "scenes instances frame_registrations frame_causes reenact_frames",
    "joint_readings": "measure_joint=measure choose_joint=choose apply_joint=apply",
    "learning_curve": "learning_curve=learn_from_more learning_samples",
    "pairs": "objects registrations uncertainty train embed reduce attribute",
    "readings.files": "readings=run join_repeats=join",
    "readings.subsets": "retrain",
    "repair": "attempt",
    "scan_causes": "scan_causes=measure diagnose_scans=diagnose",
    "scans": "draw_scans register_scans=register",
    "shift": "shift learners=fit_learners",
    "shifts": "draw_shift=draw observe_shift=observe diagnose_shifts=diagnose",
}
MODULES = {  # modules with a function ``run``
    **{name: f"gpca.steps.{name}" for name in ("exchange", "guarantee", "kernel_grid")},
    "runtime": "gpca.steps.runtime",
    "estimate": "gpca.steps.estimates",
    "recover": "gpca.steps.recovery",
    "register_methods": "gpca.steps.registration_trials",
    "repair_verdicts": "gpca.steps.repair_verdicts",
}
for module, steps in STEPS.items():
    for step in steps.split():
        MODULES[step.partition("=")[0]] = f"gpca.steps.{module}:{step.rpartition('=')[2]}"
LISTS = {  # which names of a step are lists, and not of one seed, file or name
    "active_learning": "strategies out",
    "without": "concepts",
    "controls": "retrained retrained_embeddings others other_registrations",
    "diagnose": "seeds causes read read_timings predictions timings",
    "diagnose_by_features": "seeds causes descriptors predictions",
    "estimate": "seeds estimators estimates causes rows timings",
    "diagnose_frames": "causes descriptors reenactments encoders embeddings",
    "frame_labels": "backbones embeddings strategies out",
    "kernel_grid": "seeds registrations embeddings out predictions",
    "learning_curve": "causes descriptors samples",
    "shift": "seeds registrations other_registrations embeddings encoders out",
    "learners": "seeds learners sets out",
    "register_methods": "seeds methods registrations rows timings",
    "draw_scans": "data",
    "register_scans": "methods rows timings",
    "repair_verdicts": "attempts",
    "readings": "registrations sets predictions embeddings retrained",
    "choose_joint": "measured",
    "apply_joint": "sets other_sets",
    "join_repeats": "paths",
    "scan_causes": "data",
    "diagnose_scans": (
        "scan_causes scan_descriptors scan_reenactments causes descriptors reenactments encoders embeddings"
    ),
    "exchange": "seeds registrations encoders out",
    "attribute": "seeds registrations embeddings uncertainty uncertainty_timings input_timings predictions timings",
    "model": "objects causes reenactments",
    "reduce": "seeds embeddings out",
    "train": "registrations registrations_of",
    "uncertainty": "seeds registrations outcomes tables timings",
}
NUMBERS = {"seed", "seeds", "files_seed", "surface_points", "threads"}
TEXTS = (
    "source explainer control design reduction group title name files_of encoder_of registrations_of retrained others "
    "strategies concepts estimators estimates backbones learners remedies reenactment other methods encoders_of "
    "data_dir chunk severities place"
)
SWITCHES = {"stand_in"}
CODE = "import sys; from tests.steps.by_words import main; sys.exit(main(sys.argv[1:]))"


def main(words: list[str]) -> int:
    """Run a step or a command in this process and return its status."""
    if words[0] in COMMANDS:
        return command(words)
    step = words[0]
    return as_process(f"gpca {step}", lambda: call(module_of(step), job_of(step, words[1:])))


def run_apart(words: list[str], folder: Path, code: str = CODE, threads: int = 1) -> subprocess.CompletedProcess:
    """Run a step or a command in a process of its own, or code that runs it."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | dict.fromkeys(THREAD_VARIABLES, str(threads))
    return subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, env=environment, capture_output=True, text=True
    )


def module_of(step: str) -> str:
    """Return the step that has this name in tests, as rules name it."""
    return MODULES[step]


def job_of(step: str, words: list[str]) -> Job:
    """Read the words as the files, names and settings that a rule would give the step."""
    values: dict[str, list[str]] = {}
    for word in words:
        if word.startswith("--"):
            name = word[2:].replace("-", "_")
            values[name] = []
        else:
            values[name].append(word)
    threads = int(os.environ.get("OMP_NUM_THREADS", 1))
    names = {name: _value(step, name, texts) for name, texts in values.items()}
    always = {"settings": {}, "threads": threads, "data_dir": None, "downloads": Path("downloads")}
    return Job(**always | {"surface_points": 16384} | names)


def _value(step: str, name: str, texts: list[str]) -> object:
    if name in SWITCHES:
        return True
    if name == "settings":
        return json.loads(texts[0])
    read = int if name in NUMBERS else str if name in TEXTS.split() else Path
    values = [read(text) for text in texts]
    return values if name in LISTS.get(step, "").split() else values[0]
