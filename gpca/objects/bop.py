"""Object models in the layout of the BOP benchmark: models/obj_000001.ply and models_info.json, in millimeters.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.io.structured_text import read_json
from gpca.numerals import whole
from gpca.objects.canonical import diameter
from gpca.objects.mesh_folder import meters_per, read_surface
from gpca.objects.surface import Surface

DIAMETER_TOLERANCE = 0.05


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `objects` (ids, default all) and `unit` (default mm)."""
    return surfaces(folder, entry.get("unit") or "mm", entry.get("objects"))


def surfaces(folder: str | Path, unit: str = "mm", objects: Sequence[int] | None = None) -> Iterator[Surface]:
    """Yield the models `objects` (all when None) in the order of their ids, named ``obj_000001``.

    Args:
        folder: holds obj_*.ply itself, or models/ with them, as the datasets and their archives do.
        unit: that of the vertices; the format says mm.
        objects: ids.

    Raises:
        InputError: missing folder, model or models_info.json, or a model whose diameter is not the listed one.
    """
    models = models_folder(Path(folder))
    scale = meters_per(unit)
    info = read_models_info(models / "models_info.json")
    listed_mm = {number: model["diameter"] for number, model in info.items()}
    ids = sorted(map(_id, models.glob("obj_[0-9]*.ply"))) if objects is None else sorted(objects)
    require_models(models, ids)
    if unlisted := [number for number in ids if number not in listed_mm]:
        raise InputError(models / "models_info.json", f"lists no object {unlisted[0]}", "fetch the models again")
    for number in ids:
        path = _model(models, number)
        surface = read_surface(path, scale)
        measured_mm = 1e3 * diameter(surface.vertices_m, path)
        if abs(measured_mm - listed_mm[number]) > DIAMETER_TOLERANCE * listed_mm[number]:
            raise InputError(
                path,
                f"its diameter is {measured_mm:.4g} mm in unit {unit}, but models_info.json lists "
                f"{listed_mm[number]:.4g} mm",
                "check unit in the config (BOP models are in mm), or fetch the models again",
            )
        yield surface


def _id(path: Path) -> int:
    try:
        return whole(path.stem.removeprefix("obj_"))
    except ValueError as fault:
        raise InputError(path, "is not named obj_{number}.ply", "name it like obj_000001.ply") from fault


def require_entry(entry: dict, folder: Path) -> None:
    """Raise an InputError unless the folder of a configured source has the objects that it names; reads no model."""
    if ids := entry.get("objects"):
        require_models(models_folder(folder), ids)


def require_models(models: Path, ids: Sequence[int]) -> None:
    """Raise an InputError for the first object without a model in a folder of models."""
    for number in ids:
        require_file(_model(models, number), "no such model", "check objects in the config, or fetch the models again")


def _model(models: Path, number: int) -> Path:
    return models / f"obj_{number:06d}.ply"


def models_folder(folder: Path) -> Path:
    """Return the folder that holds the models of a dataset's folder, or of one that holds it."""
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "check location and data_dir in the config")
    for candidate in (folder, folder / "models", *sorted(folder.glob("*/models"))):
        if any(candidate.glob("obj_[0-9]*.ply")):
            return candidate
    raise InputError(folder, "the folder has no models/obj_*.ply", "check location in the config")


def read_models_info(path: Path) -> dict[int, dict]:
    """Return what models_info.json lists by object id.

    Raises:
        InputError: missing, damaged, an id that is no number or stands twice, a diameter that cannot be, or a symmetry
            that is no rigid transform.
    """
    from gpca.objects.symmetry import require_symmetries  # needs scipy, and the config's checks import this module

    remedy = "fetch the models again"
    require_file(path, "no such file", f"{remedy}, or use kind: mesh_folder for plain meshes")
    listed: dict[int, dict] = {}
    for key, model in read_json(path, "a BOP models_info.json", remedy).items():
        number = int(key) if re.fullmatch("[0-9]{1,6}", key) else None
        if number is None or number in listed or not isinstance(model, dict):
            raise InputError(path, f"is not a BOP models_info.json: its entry {key[:40]!r} is no object's", remedy)
        diameter_mm: Any = model.get("diameter")
        if type(diameter_mm) not in (int, float) or not 0 < diameter_mm < math.inf:
            raise InputError(path, f"the diameter of object {key} is {repr(diameter_mm)[:40]}", remedy)
        require_symmetries(model, f"{path}: object {key}")
        listed[number] = model | {"diameter": float(diameter_mm)}
    return listed
