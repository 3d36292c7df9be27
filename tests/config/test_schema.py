import re
import subprocess
import sys
from dataclasses import fields
from typing import get_args

import pytest
from pydantic import TypeAdapter

from gpca.classifier.prior import COVARIANCES
from gpca.classifier.settings import Kernel
from gpca.config.schema import DESIGNS, Reductions, whole_config
from gpca.encoders.reduction import REDUCTIONS
from gpca.encoders.registry import ENCODERS, OPTIONS
from gpca.uncertainty import designs

from ..documents import ROOT
from .configs import load

SCHEMA = TypeAdapter(whole_config()).json_schema()


def test_names_in_the_schema_are_those_that_there_are():
    own = {"observed"}  # of the controls, which run it themselves
    assert set(DESIGNS) == set(designs.DESIGNS) - own
    assert [field.name for field in fields(Reductions)] == list(REDUCTIONS)
    assert SCHEMA["$defs"]["RealWorldSettings"]["properties"]["reductions"]["items"]["enum"] == list(REDUCTIONS)
    assert set(get_args(Kernel)) == set(COVARIANCES)
    assert set(OPTIONS) == set(ENCODERS)


def mappings(part):
    """All mappings in a part of the schema."""
    if isinstance(part, dict):
        yield part
    for inner in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
        yield from mappings(inner)


@pytest.mark.parametrize("ends", [{"minimum", "exclusiveMinimum"}, {"maximum", "exclusiveMaximum"}])
def test_every_number_of_the_config_has_its_bounds(ends):
    numbers = [part for part in mappings(SCHEMA) if part.get("type") in ("integer", "number")]
    assert len(numbers) > 100
    assert [part for part in numbers if not part.keys() & ends] == []


def test_nothing_heavy_is_loaded_to_plan_a_run():
    heavy = {"torch", "open3d", "pandas", "numba", "sklearn", "trimesh"}
    files = (ROOT / "Snakefile", *(ROOT / "workflow").rglob("*.smk"))
    modules = {name for file in files for name in re.findall(r"^(?:from|import) (gpca[\w.]*)", file.read_text(), re.M)}
    assert "gpca.config.check" in modules
    program = f"import sys, {', '.join(sorted(modules))}; sys.exit(str({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert done.stderr.strip() == "set()"


@pytest.mark.parametrize("names", [(), ("smoke",), ("full",)])
def test_the_shipped_configs_have_training_samples_for_every_start(names):
    config = load(*names)
    train, active = config["registrations"]["train"], config["active_learning"]
    pool = config["readings"]["groups"]["pool"]
    for initial in (active["initial"], *([min(pool["initial"])] if pool else [])):
        assert initial // 2 < train // 3
    stream, known = active["stream"], 2 * (train // 3 - active["initial"] // 2)
    new = round((stream["arrivals"] - stream["quiet"]) / 3)
    assert 0 < new <= train // 3
    assert stream["arrivals"] - new <= known
    for cause in ("noise", "pose", "overlap"):
        assert active["initial"] // 3 <= round(config["causes"]["shares"][cause] * config["causes"]["train"])
