"""What a processor may change, and a chain of all steps on two processors, as far as one machine can be two."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gpca.process import processor
from gpca.process.code_files import ROOT
from tests.steps.command_lines import arguments, every_step

# Each says of one library that it runs on another processor: without AVX, with AVX-512, or one of the other vendor.
OTHER_PROCESSOR = {
    "OPENBLAS_CORETYPE": "Nehalem",
    "MKL_CBWR": "AUTO",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "ATEN_CPU_CAPABILITY": "default",
    "ONEDNN_MAX_CPU_ISA": "SSE41",
    "NUMBA_CPU_NAME": "nehalem",
    "NUMBA_CPU_FEATURES": "",
}
EXPLAINERS = {
    "analytical_gpc": {"iterations": 5, "inducing": 6},
    "concept_vectors": {},
    "residuals_forest": {"trees": 20},
    "shap_supervised": {},
    "softmax_head": {},
}
LEARNERS = {
    "gpca": {"iterations": 5, "inducing": 6, "draws": 20},
    "learner_dirichlet_gp": {"iterations": 5},
    "learner_ensemble": {"members": 2, "steps": 10},
    "learner_forest": {},
}
PREPARED = "from gpca.process.processor import prepare; prepare(); import json, sys; "
CHAIN = (
    PREPARED + "from tests.steps.by_words import main; sys.exit(any([main(words) for words in json.load(sys.stdin)]))"
)
GUARDED = PREPARED + "from tests.vendor_guard import main; sys.exit(main())"
LEFT_OUT = {"label", "runtime", "explain"}  # they give seconds, or text
# Files of seconds; and a model's and an explanation's provenance.
SECONDS = {"icp.csv", "dgcnn.csv", "gpca.csv", "uncertainty_timings.csv", "other_icp.csv", "frame_icp.csv"}
SECONDS |= {"causes_timings.csv", "descriptors.csv", "cause_embeddings.csv", "diagnosis_timings.csv", "repairs.csv"}

needs_the_level = pytest.mark.skipif(
    not processor._flags() >= processor._REQUIRED_FLAGS, reason="needs a processor with AVX2 and FMA"
)


def words(step: str, **options) -> list[str]:
    found = [step]
    for name, value in options.items():
        values = value if isinstance(value, list) else [json.dumps(value) if isinstance(value, dict) else value]
        found += [f"--{name.replace('_', '-')}", *map(str, values)]
    return found


def chain() -> list[list[str]]:
    """Words of steps from meshes, shapes of our own and virtual frames to predictions of every kind of explainer."""
    frames = {
        "count": 2, "views": 2, "objects": [3, 3], "camera": {"width": 160, "height": 120, "focal_px": 150},
        "families": ["ycb"],
    }  # fmt: skip
    tiny = {"source": "tiny", "seed": 0}
    lines = [
        words("scenes", source="frames", settings=frames, out="scenes"),
        words("instances", source="frames", settings={}, scenes="scenes", surface_points=1024,
              instances="instances.npz", objects="seen.npz"),
        words("frame_registrations", source="frames", seed=0, settings={"train": 9, "test": 6, "cloud_points": 128,
              "test_share": 0.4}, instances="instances.npz", objects="seen.npz", registrations="frames.npz",
              poses="poses.csv", timings="frame_icp.csv"),
        words("objects", source="linemod", settings={"kind": "procedural", "family": "linemod"}, surface_points=400,
              out="procedural.npz"),
        *every_step(LEFT_OUT),
    ]  # fmt: skip
    settings = {"backbone": "pointnext", "draw_points": 64, "draws": 1, "epochs": 1, "batch_size": 6}
    lines.append(words("train", **tiny, settings=settings, registrations="registrations.npz", weights="pointnext.pt",
                       curve="pointnext.csv"))  # fmt: skip
    # Not UMAP: it compiles for a quarter of a minute in every process, by numba and NumPy, which the others show.
    reduced = {"--reduction": "pca", "--settings": {"components": 2}, "--out": "pca.npz"}
    lines.append(arguments("reduce", reduced))
    for name, settings in EXPLAINERS.items():
        inputs = {"--uncertainty": "uncertainty.npz", "--uncertainty-timings": "uncertainty_timings.csv"}
        lines.append(arguments("attribute", {"--explainer": name, "--settings": settings, **inputs,
                     "--predictions": f"{name}.csv", "--timings": "gpca.csv"}))  # fmt: skip
    outputs = [f"{name}.csv" for name in LEARNERS]
    lines.append(arguments("learners", {"--settings": LEARNERS, "--learners": list(LEARNERS), "--out": outputs}))
    return lines


def with_meshes(folder: Path) -> Path:
    import trimesh

    (folder / "meshes").mkdir(parents=True)
    trimesh.creation.box((40, 70, 100)).export(folder / "meshes/brick.stl")
    trimesh.creation.cone(30, 90).export(folder / "meshes/cone.ply")
    return folder


def made_on(folder: Path, lines: list[list[str]], program: str = CHAIN, **variables: str) -> tuple[dict[str, str], str]:
    """Run these steps in a folder, in a process with these variables.

    Returns:
        The SHA-256 of each file but those of seconds, and the standard output.
    """
    environment = {name: value for name, value in os.environ.items() if name not in processor._PINS}
    environment |= {"PYTHONPATH": str(ROOT), **variables}
    done = subprocess.run(
        [sys.executable, "-c", program], input=json.dumps(lines), env=environment, cwd=folder, text=True,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    hashes = {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in SECONDS and not path.name.endswith(("_seconds.csv", ".provenance.json"))
    }
    return hashes, done.stdout


@pytest.fixture(scope="module")
def here(tmp_path_factory) -> tuple[Path, dict[str, str], str]:
    """The chain on this processor, under the eyes of the guard: its folder, and what `made_on` returns."""
    folder = with_meshes(tmp_path_factory.mktemp("here") / "run")
    return folder, *made_on(folder, chain(), GUARDED)


@needs_the_level
def test_two_processors_give_the_same_bytes_and_would_not_without_the_pins(here, tmp_path):
    folder, own, _ = here
    there, _ = made_on(with_meshes(tmp_path / "there"), chain(), **OTHER_PROCESSOR)
    assert [name for name in own if own[name] != there.get(name)] == []
    assert len(own) == len(there)
    # A step without loops: those would be compiled again.
    shutil.copytree(folder, tmp_path / "native")
    variables = OTHER_PROCESSOR | {processor.INSTRUCTIONS_VARIABLE: "native"}
    native, _ = made_on(tmp_path / "native", [arguments("reduce")], **variables)
    assert {name for name in own if own[name] != native[name]} == {"reduced.npz"}


@needs_the_level
def test_no_step_leaves_a_rounding_to_the_vendor(here):
    """The two processors above share one table of estimates, so their agreement does not show this."""
    assert json.loads(here[2].splitlines()[-1]) == []


@needs_the_level
def test_every_library_obeys():
    script = """
import json
from gpca.process.processor import prepare
prepare()
import numba, numpy._core._multiarray_umath as umath, scipy.linalg, torch
from numba import njit
from threadpoolctl import threadpool_info
compiled = njit(lambda x: x * 2.0 + 1.0)
compiled(1.0)
[code] = compiled.inspect_asm().values()
print(json.dumps({
    "numpy": [name for name in umath.__cpu_dispatch__ if umath.__cpu_features__[name]],
    "blas": [pool["architecture"] for pool in threadpool_info() if pool["user_api"] == "blas"],
    "torch": torch.backends.cpu.get_cpu_capability(),
    "numba": numba.core.registry.cpu_target.target_context.codegen().target_data and numba.config.CPU_NAME,
    "threads": [pool["num_threads"] for pool in threadpool_info()],
}))
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT), **OTHER_PROCESSOR}
    told = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    found = json.loads(told.stdout)
    assert found["numpy"] == ["X86_V3"]
    assert set(found["blas"]) == {"Haswell"}
    assert found["torch"] == "AVX2"
    assert found["numba"] == processor.COMMON_LEVEL
    assert set(found["threads"]) == {1}


@pytest.fixture
def cpuinfo(monkeypatch, tmp_path):
    """Another /proc/cpuinfo, and an environment without pins."""
    for name in processor._PINS:
        monkeypatch.delenv(name, raising=False)

    def write(text):
        (tmp_path / "cpuinfo").write_text(text)
        monkeypatch.setattr(processor, "CPUINFO", tmp_path / "cpuinfo")

    return write


HASWELL = """processor\t: 0
vendor_id\t: GenuineIntel
cpu family\t: 6
model\t\t: 60
model name\t: A Haswell
flags\t\t: fpu avx avx2 fma bmi1 bmi2 f16c movbe abm sse4_2 ht

processor\t: 1
model name\t: Another
"""


def test_a_processor_is_described_by_what_libraries_choose_by(cpuinfo):
    cpuinfo(HASWELL)
    found = processor.describe()
    assert found["name"] == f"A Haswell, {os.cpu_count()} cores"
    assert (found["vendor"], found["family"], found["model"]) == ("GenuineIntel", "6", "60")
    assert found["flags"] == ["avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "sse4_2"]
    assert found["instructions"] == "native"
    processor.prepare(3)
    assert processor.describe()["instructions"] == processor.instructions() == processor.COMMON_LEVEL
    assert {os.environ[name] for name in processor.THREAD_VARIABLES} == {"3"}


@pytest.mark.parametrize("missing", sorted(processor._REQUIRED_FLAGS))
def test_a_processor_without_the_level_keeps_its_own_instructions(cpuinfo, missing):
    cpuinfo(HASWELL.replace(f" {missing}", "", 1))
    assert processor.pin_instructions() == processor.instructions() == "native"
    assert "OPENBLAS_CORETYPE" not in os.environ  # Haswell's kernels would end it with an illegal instruction


def test_whoever_wants_the_fastest_instructions_has_them(cpuinfo, monkeypatch):
    cpuinfo(HASWELL)
    monkeypatch.setenv(processor.INSTRUCTIONS_VARIABLE, "native")
    assert processor.pin_instructions() == "native"
    assert "OPENBLAS_CORETYPE" not in os.environ


def test_a_system_that_tells_nothing_of_its_processor(cpuinfo, monkeypatch, tmp_path):
    monkeypatch.setattr(processor, "CPUINFO", tmp_path / "nowhere")
    assert processor.pin_instructions() == "native"
    assert processor.describe()["vendor"] is None
    assert "cores" in processor.describe()["name"]
