"""Object models in the layout of the BOP benchmark: models/obj_000001.ply and models_info.json, in millimeters."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.io.structured_text import finite_numbers, read_json
from gpca.numerals import whole
from gpca.objects.canonical import diameter
from gpca.objects.mesh_folder import read_surface
from gpca.objects.surface import Surface, meters_per
from gpca.rigid import rigid_motion

DIAMETER_TOLERANCE = 0.05


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `objects` (ids, default all) and `unit` (default mm)."""
    models, ids = models_folder(folder), listed_objects(entry)
    if not ids:
        for path in models.glob("obj_[0-9]*.ply"):
            with refusing(path, "is not named obj_{number}.ply", "name it like obj_000001.ply"):
                ids.append(whole(path.stem.removeprefix("obj_")))
    info = read_models_info(models / "models_info.json")
    return read_models(models, entry.get("unit") or "mm", sorted(ids), info)


def listed_objects(entry: Mapping[str, Any]) -> list[int]:
    """Return the ids of the objects that an entry names; none where it leaves the key out and thus means all."""
    if (ids := entry.get("objects")) == []:
        raise InputError("objects", "is an empty list", "name the objects, or leave it out for all")
    return sorted(ids or ())


def read_models(models: Path, unit: str, ids: Sequence[int], info: Mapping[int, dict]) -> Iterator[Surface]:
    """Yield the models of these objects, named ``obj_000001``; InputError where a diameter is not the listed one."""
    require_models(models, ids)
    if unlisted := [number for number in ids if number not in info]:
        raise InputError(models / "models_info.json", f"lists no object {unlisted[0]}", "fetch the models again")
    for number in ids:
        path, listed_mm = _model(models, number), info[number]["diameter"]
        surface = read_surface(path, meters_per(unit))
        measured_mm = 1e3 * diameter(surface.vertices_m, path)
        if abs(measured_mm - listed_mm) > DIAMETER_TOLERANCE * listed_mm:
            fault = f"its diameter is {measured_mm:.4g} mm in unit {unit}, but models_info.json lists"
            remedy = "check unit in the config (BOP models are in mm), or fetch the models again"
            raise InputError(path, f"{fault} {listed_mm:.4g} mm", remedy)
        yield surface


def require_entry(entry: dict, folder: Path) -> None:
    """Raise an InputError unless the folder has a model of each object that the entry names; reads no model."""
    if ids := listed_objects(entry):
        require_models(models_folder(folder), ids)


def require_models(models: Path, ids: Sequence[int]) -> None:
    """Raise an InputError for the first object without a model in a folder of models."""
    for number in ids:
        require_file(_model(models, number), "no such model", "check objects in the config, or fetch the models again")


def _model(models: Path, number: int) -> Path:
    return models / f"obj_{number:06d}.ply"


def models_folder(folder: Path) -> Path:
    """Return the folder of the models: `folder` itself, `models` in it, or `models` in one of its folders."""
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "check location and data_dir in the config")
    for candidate in (folder, folder / "models", *sorted(folder.glob("*/models"))):
        if any(candidate.glob("obj_[0-9]*.ply")):
            return candidate
    raise InputError(folder, "the folder has no models/obj_*.ply", "check location in the config")


def read_models_info(path: Path) -> dict[int, dict]:
    """Return the entries of models_info.json by object id; InputError for a damaged file or impossible values."""
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


REMEDY = "write it as the BOP format does"
TOLERANCE = 0.01  # diameters
SOUGHT_POINTS = 4096  # of a cloud, the first ones, on which symmetries are sought
DISCRETE_DEG = (90.0, 180.0)
CONTINUOUS_DEG = (25.0, 50.0, 75.0)  # none is a symmetry of a square or hexagonal shape


def read_symmetries(models_info: dict[int, dict], object_id: int) -> dict | None:
    """Return an object's listed symmetries, perhaps none; None where the file lists no symmetry of any object."""
    lists = {n: {k: v for k, v in entry.items() if k.startswith("symmetries_")} for n, entry in models_info.items()}
    return lists.get(object_id, {}) if any(lists.values()) else None


def require_symmetries(listed: Mapping[str, Any], subject: str) -> None:
    """Raise an InputError unless listed symmetries are rigid: 4×4, row by row, or an axis and an offset in mm."""
    for key in ("symmetries_discrete", "symmetries_continuous"):
        if not isinstance(listed.get(key, []), list):
            raise InputError(f"{subject}, {key}", "is not a list", "list the symmetries, or leave the key out")
    for n, matrix in enumerate(listed.get("symmetries_discrete", ())):
        place = f"{subject}, symmetries_discrete {n}"
        T = finite_numbers(matrix, 16, place, "it", REMEDY).reshape(4, 4)
        R = T[:3, :3]
        if not (np.allclose(R @ R.T, np.eye(3), atol=1e-3) and np.linalg.det(R) > 0 and (T[3] == (0, 0, 0, 1)).all()):
            raise InputError(place, "is not a rotation and a shift", "give a rigid transform, row by row")
    for n, turn in enumerate(listed.get("symmetries_continuous", ())):
        place = f"{subject}, symmetries_continuous {n}"
        axis, offset = (turn.get(key) if isinstance(turn, Mapping) else None for key in ("axis", "offset"))
        if not np.linalg.norm(finite_numbers(axis, 3, place, "axis", REMEDY)) > 0:
            raise InputError(place, "axis has no direction", "give the axis of revolution, such as 0 0 1")
        finite_numbers(offset, 3, place, "offset", REMEDY)


def find_symmetries(
    points_N_3: np.ndarray, diameter: float, distances: Callable | None = None, limit: float = TOLERANCE
) -> dict[str, list]:
    """Return the turns about the box axes that leave points within `limit` diameters of the surface, as BOP does."""
    from scipy.spatial import cKDTree
    from scipy.spatial.transform import Rotation

    points_N_3 = np.asarray(points_N_3[:SOUGHT_POINTS], np.float64)
    if distances is None:
        tree = cKDTree(points_N_3)
        limit = limit * diameter + tree.query(points_N_3, k=2)[0][:, 1].mean()

    def fits(axis: np.ndarray, angle_deg: float) -> bool:
        turned = Rotation.from_rotvec(np.deg2rad(angle_deg) * axis).apply(points_N_3)
        return (distances(turned) if distances else tree.query(turned)[0]).mean() < limit

    symmetries: dict[str, list] = {"symmetries_discrete": [], "symmetries_continuous": []}
    for axis in np.eye(3):
        if all(fits(axis, angle) for angle in CONTINUOUS_DEG):
            symmetries["symmetries_continuous"].append({"axis": axis.tolist(), "offset": [0.0, 0.0, 0.0]})
            continue
        for angle in DISCRETE_DEG:
            if fits(axis, angle):
                R = Rotation.from_rotvec(np.deg2rad(angle) * axis).as_matrix()
                symmetries["symmetries_discrete"].append(rigid_motion(R).round(9).ravel().tolist())
    return {key: entries for key, entries in symmetries.items() if entries}


def angle_up_to_symmetry(R_3_3: np.ndarray, symmetries: Mapping[str, list]) -> float:
    """Return the smallest angle, in radians, of a rotation combined with a symmetry from :func:`find_symmetries`."""
    from scipy.spatial.transform import Rotation

    axes = [entry["axis"] for entry in symmetries.get("symmetries_continuous", [])]
    if len(axes) > 1:  # every rotation is a symmetry
        return 0.0
    quaternions_K_4 = Rotation.from_matrix(R_3_3 @ _generated(symmetries)).as_quat()
    cosine_squared_K = quaternions_K_4[:, 3] ** 2
    for axis in axes:  # cos² of half the smallest angle of a quaternion (w, v) about it is w² + (v·a)²
        cosine_squared_K += (quaternions_K_4[:, :3] @ np.asarray(axis)) ** 2
    return float(2 * np.arccos(np.sqrt(min(1.0, cosine_squared_K.max()))))


def symmetric_turn(R_3_3: np.ndarray, symmetries: Mapping[str, list]) -> np.ndarray:
    """Return the symmetry S (3, 3) for which the angle of R S is that of :func:`angle_up_to_symmetry`."""
    from scipy.spatial.transform import Rotation

    axes = [np.asarray(entry["axis"], np.float64) for entry in symmetries.get("symmetries_continuous", [])]
    if len(axes) > 1:
        return R_3_3.T
    turns = list(_generated(symmetries))
    for i, turn in enumerate(turns):
        for axis in axes:
            x, y, z, w = Rotation.from_matrix(R_3_3 @ turn).as_quat()
            half_angle = np.arctan2(-(axis @ (x, y, z)), w)
            turns[i] = turn @ Rotation.from_rotvec(2 * half_angle * axis).as_matrix()
    cosines = [abs(Rotation.from_matrix(R_3_3 @ turn).as_quat()[3]) for turn in turns]
    return turns[int(np.argmax(cosines))]


def _generated(symmetries: Mapping[str, list]) -> np.ndarray:
    """Return the group (K, 3, 3) that the discrete symmetries generate, the identity first."""
    listed = [np.reshape(T, (4, 4))[:3, :3] for T in symmetries.get("symmetries_discrete", [])]
    group = [np.eye(3)]
    for turn in group:  # which grows meanwhile
        for R in listed:
            product = R @ turn
            if not any(np.allclose(product, other, atol=1e-6) for other in group):
                group.append(product)
    return np.array(group)
