import subprocess
import sys
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

import pytest
import yaml

from gpca.classifier.covariances import COVARIANCES
from gpca.classifier.settings import Kernel
from gpca.config import schema
from gpca.config.json_schema import COMPLETE, Keys, Named, schema_of
from gpca.encoders.reduction import REDUCTIONS
from gpca.encoders.registry import ENCODERS
from gpca.encoders.settings import OPTIONS
from gpca.errors import InputError
from gpca.settings import SCHEMA, Bounds
from gpca.uncertainty.designs import DESIGNS


def test_the_file_is_what_the_settings_classes_say():
    schema.main(["--check"])


def test_a_file_that_differs_is_found_and_made_anew(tmp_path, monkeypatch):
    file = tmp_path / "config.schema.yaml"
    file.write_text(SCHEMA.read_text().replace("minimum: 9", "minimum: 8", 1))
    monkeypatch.setattr(schema, "SCHEMA", file)
    with pytest.raises(InputError, match=r"^config\.schema\.yaml: does not match the settings classes; run 'python -m"):
        schema.main(["--check"])
    schema.main([])
    assert file.read_bytes() == SCHEMA.read_bytes()


def test_names_in_the_schema_are_those_that_there_are():
    sections = yaml.safe_load(SCHEMA.read_text())["properties"]
    own = {"observed"}  # of the controls, which run it themselves
    assert set(sections["uncertainty"]["propertyNames"]["enum"]) == set(DESIGNS) - own
    assert list(sections["reductions"]["properties"]) == list(REDUCTIONS)
    assert sections["real_world"]["properties"]["reductions"]["items"]["enum"] == list(REDUCTIONS)
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
    kinds = ("integer", "number", ["integer", "null"], ["number", "null"])
    numbers = [part for part in mappings(yaml.safe_load(SCHEMA.read_text())) if part.get("type") in kinds]
    assert len(numbers) > 100
    assert [part for part in numbers if not part.keys() & ends] == []


def test_nothing_heavy_is_loaded_to_make_or_read_the_schema():
    heavy = {"torch", "open3d", "pandas", "numba", "sklearn"}
    program = f"import sys, gpca.config.schema, gpca.config.check; sys.exit(str({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stderr.strip() == "set()"


@dataclass
class Inner:
    size: Annotated[int, Bounds(minimum=1)] = 2


@dataclass
class Outer:
    name: str
    inner: Inner
    share: Annotated[float, Bounds(minimum=0)] | None = None


NUMBER = {"type": "number", "maximum": 1e12}
INTEGER = {"type": "integer", "maximum": 10**6}
INNER = {"type": "object", "additionalProperties": False, "properties": {"size": INTEGER | {"minimum": 1}}}


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (bool, {"type": "boolean"}),
        (Literal["a", "b"], {"enum": ["a", "b"]}),
        (float | None, NUMBER | {"type": ["number", "null"]}),
        (str | int, {"anyOf": [{"type": "string"}, INTEGER]}),
        (tuple[float, float], {"type": "array", "minItems": 2, "maxItems": 2, "items": NUMBER}),
        (tuple[float, ...], {"type": "array", "minItems": 1, "uniqueItems": True, "items": NUMBER}),
        (list[float], {"type": "array", "minItems": 1, "items": NUMBER}),
        (dict[str, float], {"type": "object", "additionalProperties": NUMBER}),
        (Annotated[dict[str, float], Named({"a": int})],
         {"type": "object", "additionalProperties": NUMBER, "properties": {"a": INTEGER}}),
        (Annotated[dict[str, float], Named({"a": float}, closed=True)],
         {"type": "object", "additionalProperties": False, "required": ["a"], "properties": {"a": NUMBER}}),
        (Annotated[float, Bounds(exclusiveMaximum=1)], {"type": "number", "exclusiveMaximum": 1}),
        (Inner, INNER),
        (Annotated[Inner, COMPLETE], INNER | {"required": ["size"]}),
    ],
)  # fmt: skip
def test_a_type_has_its_schema(kind, expected):
    assert schema_of(kind) == expected


def test_fields_are_required_where_they_have_no_default_or_the_section_says_so():
    assert schema_of(Outer)["required"] == ["name", "inner"]
    assert schema_of(Annotated[Outer, Keys(required=("share",))])["required"] == ["share"]
    complete = schema_of(Annotated[Outer, COMPLETE])
    assert complete["required"] == ["name", "inner", "share"]
    assert complete["properties"]["inner"]["required"] == ["size"]
    assert list(schema_of(Annotated[Outer, Keys(without=("inner",))])["properties"]) == ["name", "share"]


def test_a_type_without_a_schema_is_refused():
    with pytest.raises(TypeError, match="no JSON schema of"):
        schema_of(Any)
