"""Configured data sets of scans: entries of the config, where files are, and readers (docs/real_world.md)."""

import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.arrays import REAL, load_arrays
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.io.files import require_file
from gpca.numerals import decimal, whole
from gpca.objects.canonical import require_points
from gpca.objects.entry import Place, Text, Unit
from gpca.objects.mesh_folder import read_surface
from gpca.objects.source import places_of, require_no_root
from gpca.objects.surface import meters_per
from gpca.rigid import require_rigid, scale_translation
from gpca.scans.pair import Kind
from gpca.scans.scene import Known, Scan, ScannedScene
from gpca.seeds import generator
from gpca.settings import Bounds, read_settings

ScanKind = Literal["virtual", "npz", "ply_folder", "threedmatch"]
Number = Annotated[int, Bounds(minimum=0, maximum=100)]


@dataclass(frozen=True, kw_only=True)
class ScanEntry:
    """A data set of scans: one row of each method in every table."""

    title: Text  # of the rows in tables
    kind: ScanKind  # how the data is read; `virtual` is made by the package
    location: Place | None = None  # a file or folder, relative to `data_dir` or to the repository's data
    scenes: Kind | None = None  # npz files may say so themselves
    unit: Unit = "m"  # of lengths in the files
    optional: bool = False  # a run does without it where its location is missing
    sensor_at_origin: bool = False  # of each scan's frame, to which normals point
    development: tuple[Text, ...] = ()  # scenes on which settings were chosen; other runs leave them out
    families: Mapping[str, Text] = field(default_factory=dict)  # of scenes that are alike, by the name of the scene
    benchmark: bool = False  # it is 3DMatch's, whose recalls others have published
    address: Text = ""  # of the data
    license: Text = ""
    rooms: Number = 0  # virtual ones
    objects: Number = 0  # virtual ones
    views: Annotated[int, Bounds(minimum=2, maximum=100)] = 8  # scans of each virtual scene

    def __post_init__(self) -> None:
        if self.kind == "virtual" and not self.rooms + self.objects:
            raise InputError("rooms", "there are neither rooms nor objects", "set rooms or objects above 0")
        if self.kind != "virtual" and not self.location:
            raise InputError("location", "is missing", "name the file or folder of the scans")

    @property
    def stand_in(self) -> bool:
        """Whether no sensor measured it."""
        return self.kind == "virtual"

    @property
    def scale(self) -> float:
        """The meters in one unit of the files."""
        return meters_per(self.unit)

    def scan(self, points_m_N_3: np.ndarray, T_scene_scan: np.ndarray | None = None) -> Scan:
        """Return a scan in meters, whose pose is in the unit of the files."""
        T_m = None if T_scene_scan is None else scale_translation(T_scene_scan, self.scale)
        return Scan(points_m_N_3, T_m, np.zeros(3) if self.sensor_at_origin else None)


PAIRS = "pairs.csv"
NPZ_REMEDY = "make it as docs/real_world.md says"
NPZ_POSES: dict[str, Kind] = {"T_scene_cloud": "room", "T_model_cloud": "object"}
NAME_ARRAYS = ("name", "index")
CLOUD = "cloud_"


def npz_scenes(entry: ScanEntry, place: Path) -> Iterator[ScannedScene]:
    """Yield the scene of each npz file of a folder, by name, or of the one file; InputError for a faulty one."""
    files = sorted(place.glob("*.npz")) if place.is_dir() else [place]
    if not files:
        raise InputError(place, "the folder has no npz file", "correct location")
    listed = _read_pairs(pairs := files[0].parent / PAIRS)
    if unknown := sorted(listed.keys() - {path.stem for path in pairs.parent.glob("*.npz")}):
        raise InputError(pairs, f"names the scene '{unknown[0]}', of which there is no npz file", "remove its rows")
    for path in files:
        require_file(path, "no such file", "correct location", np.inf)
        # zipfile raises errors of many kinds for a damaged archive.
        with refusing(path, "is not a readable npz archive", "fetch it again"), zipfile.ZipFile(path) as archive:
            members = [name.removesuffix(".npy") for name in archive.namelist()]
        poses = next((name for name in NPZ_POSES if name in members), None)
        if poses is None:
            raise InputError(path, f"has neither {' nor '.join(NPZ_POSES)}", NPZ_REMEDY)
        order = next((name for name in NAME_ARRAYS if name in members), None)
        shapes: dict[str, tuple[int | str, ...]] = {poses: ("F", 4, 4)} | ({order: ("F",)} if order else {})
        head = load_arrays(path, shapes, {poses: REAL}, remedy=NPZ_REMEDY)
        names = [str(name) for name in (head[order] if order else range(len(head[poses])))]
        if len(set(names)) < len(names):
            raise InputError(path, f"array '{order}' names a cloud twice", NPZ_REMEDY)
        wanted = {f"{CLOUD}{name}": (f"N{name}", 3) for name in names}
        if more := [name for name in members if name.startswith(CLOUD) and name not in wanted]:
            raise InputError(path, f"array '{more[0]}' has no pose", NPZ_REMEDY)
        clouds = load_arrays(path, wanted, dict.fromkeys(wanted, REAL), remedy=NPZ_REMEDY)
        scans = {}
        for name, T_scene_scan in zip(names, head[poses].astype(np.float64), strict=True):
            points_N_3 = clouds[f"{CLOUD}{name}"].astype(np.float64)
            require_points(points_N_3, f"{path}, {CLOUD}{name}")
            require_rigid(T_scene_scan, f"{path}, {poses} of {name}")
            scans[name] = entry.scan(points_N_3 * entry.scale, T_scene_scan)
        yield ScannedScene(path.stem, entry.scenes or NPZ_POSES[poses], scans, listed.get(path.stem, ()))


def _read_pairs(path: Path) -> dict[str, tuple[Known, ...]]:
    if not path.is_file():
        return {}
    rows = read_csv(path, ("scene", "target", "source", "overlap"), ANY, "correct it as docs/real_world.md says")
    rows["overlap"] = numbers(path, rows, "overlap", least=0)
    if (rows["overlap"] > 1).any():
        raise InputError(path, "column 'overlap' contains numbers above 1", "give shares from 0 to 1")
    listed: dict[str, dict[tuple[str, str], Known]] = {}
    for scene, target, source, share in rows[["scene", "target", "source", "overlap"]].itertuples(index=False):
        known = Known(target, source, float(share))
        if target == source or listed.setdefault(scene, {}).setdefault((target, source), known) != known:
            words = "pairs it with itself" if target == source else f"gives it two overlaps with {source}"
            raise InputError(f"{path}, scan {target} of {scene}", words, "correct or remove a row")
    return {scene: tuple(pairs.values()) for scene, pairs in listed.items()}


POSES_FILE = "poses.txt"
POSES_REMEDY = "write a name and the 16 numbers of a pose in each line"


def ply_scenes(entry: ScanEntry, place: Path) -> Iterator[ScannedScene]:
    """Yield the scene of the folder, or of each folder in it, by name; InputError for a faulty one."""
    if not entry.scenes:
        raise InputError(entry.title, "does not say what its scenes are", "set scenes: room, or object")
    files = [place / POSES_FILE] if (place / POSES_FILE).exists() else sorted(place.glob(f"*/{POSES_FILE}"))
    if not files:
        raise InputError(place / POSES_FILE, "no such file", "give the poses of the scans as docs/real_world.md says")
    for path in files:
        scans = {
            name: entry.scan(read_surface(path.with_name(f"{name}.ply"), entry.scale).vertices_m, T_scene_scan)
            for name, T_scene_scan in read_poses(path).items()
        }
        yield ScannedScene(path.absolute().parent.name, entry.scenes, scans)


def read_poses(path: Path) -> dict[str, np.ndarray]:
    """Return the pose (4×4) of each scan by name; InputError for a line other than a name and a rigid pose."""
    require_file(path, "no such file", POSES_REMEDY)
    poses: dict[str, np.ndarray] = {}
    for subject, (name, *words) in _lines_of(path):
        if len(words) != 16:
            raise InputError(subject, f"has {1 + len(words)} words", POSES_REMEDY)
        if Path(name).name != name or name in poses:
            fault = f"'{name}' is no name of a file beside it, or stands there twice"
            raise InputError(subject, fault, POSES_REMEDY)
        with refusing(subject, "{}", POSES_REMEDY):
            poses[name] = np.array([decimal(word) for word in words]).reshape(4, 4)
        require_rigid(poses[name], subject)
    if not poses:
        raise InputError(path, "has no poses", POSES_REMEDY)
    return poses


def _lines_of(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield the place and the words of each line that has any, without comments; commas separate, too."""
    for number, line in enumerate(path.read_text("utf-8", errors="replace").splitlines(), 1):
        if words := line.split("#")[0].replace(",", " ").split():
            yield f"{path}, line {number}", words


LINES_OF_PAIR = 5  # of a pair in gt.log
BENCHMARK_REMEDY = "fetch the benchmark again"


def benchmark_scenes(entry: ScanEntry, place: Path) -> Iterator[ScannedScene]:
    """Yield the scene of each folder with fragments, by name; InputError for a faulty one."""
    folder = place / "fragments" if (place / "fragments").is_dir() else place
    scene_folders = sorted({path.parent for path in folder.glob("*/cloud_bin_*.ply")})
    if not scene_folders:
        raise InputError(folder, "has no <scene>/cloud_bin_<number>.ply", "correct location")
    for scene_folder in scene_folders:
        evaluation = f"{scene_folder.name}-evaluation"
        folders = (scene_folder, scene_folder.with_name(evaluation), place / "gt_result" / evaluation)
        log = next((path for path in (folder / "gt.log" for folder in folders) if path.is_file()), None)
        if log is None:
            raise InputError(scene_folder / "gt.log", "no such file", f"put it there, or into {evaluation} beside it")
        shares = _read_overlaps(log.with_name("gt_overlap.log"))
        printed = tuple(
            Known(target, source, shares.get((target, source)), scale_translation(T, entry.scale))
            for (target, source), T in read_log(log).items()
        )
        named = sorted({name for pair in printed for name in (pair.target, pair.source)}, key=int)
        files = {name: scene_folder / f"cloud_bin_{name}.ply" for name in named}
        scans = {name: entry.scan(read_surface(path, entry.scale).vertices_m) for name, path in files.items()}
        yield ScannedScene(scene_folder.name, entry.scenes or "room", scans, printed)


def read_log(path: Path) -> dict[tuple[str, str], np.ndarray]:
    """Return ``T_target_source`` (4×4) of each pair of a ``gt.log``, by the numbers of target and source."""
    require_file(path, "no such file", BENCHMARK_REMEDY)
    lines = [words for _, words in _lines_of(path)]
    if not lines or len(lines) % LINES_OF_PAIR:
        raise InputError(path, f"has {len(lines)} lines, not {LINES_OF_PAIR} for each pair", BENCHMARK_REMEDY)
    poses = {}
    for start in range(0, len(lines), LINES_OF_PAIR):
        (head, *rows), subject = lines[start : start + LINES_OF_PAIR], f"{path}, pair {start // LINES_OF_PAIR + 1}"
        if len(head) != 3 or any(len(row) != 4 for row in rows):
            raise InputError(subject, "it has not 3 numbers and then 4 in each of 4 lines", BENCHMARK_REMEDY)
        with refusing(subject, "{}", BENCHMARK_REMEDY):
            target, source = (str(whole(word)) for word in head[:2])
            T_target_source = np.array([[decimal(word) for word in row] for row in rows])
        require_rigid(T_target_source, subject)
        if (target, source) in poses or target == source:
            raise InputError(subject, f"pairs {target} with {source} once more, or with itself", BENCHMARK_REMEDY)
        poses[target, source] = T_target_source
    return poses


def _read_overlaps(path: Path) -> dict[tuple[str, str], float]:
    shares = {}
    for subject, words in _lines_of(path) if path.is_file() else ():
        with refusing(subject, "{}", BENCHMARK_REMEDY):
            if len(words) != 3:
                raise ValueError(f"has {len(words)} numbers instead of target, source and overlap")
            target, source, share = str(whole(words[0])), str(whole(words[1])), decimal(words[2])
            if not 0 <= share <= 1:
                raise ValueError(f"the overlap {share:g} is no share")
        shares[target, source] = share
    return shares


SUFFIXES = (".npz", ".csv", ".ply", ".txt", ".log")
DEVELOPMENT = "development"  # of the roles of a run


def entry_of(settings: Mapping[str, Any]) -> ScanEntry:
    """Return an entry of the config, checked; InputError for an unknown key, a wrong type, or no location."""
    return read_settings(ScanEntry, settings)


def place_of(entry: ScanEntry, data_dir: str | None) -> Path | None:
    """Return the file or folder of a data set; None for a virtual one, or an optional one that is missing."""
    if entry.kind == "virtual":
        return None
    places = places_of(entry.location or "", data_dir)
    if place := next((place for place in places if place.exists()), None):
        require_no_root(place)
        return place
    if entry.optional:
        return None
    remedy = f"get it from {entry.address}" if entry.address else "correct location, or set data_dir"
    raise InputError(places[0], "no such file or folder", remedy)


def data_files(entry: ScanEntry, data_dir: str | None) -> list[Path]:
    """Return the files that a data set is read from, sorted; none of a virtual one."""
    if (place := place_of(entry, data_dir)) is None:
        return []
    files = [place] if place.is_file() else [path for path in place.rglob("*") if path.suffix.lower() in SUFFIXES]
    return sorted(files)


READERS: dict[str, Callable[[ScanEntry, Path], Iterator[ScannedScene]]] = {
    "npz": npz_scenes,
    "ply_folder": ply_scenes,
    "threedmatch": benchmark_scenes,
}


def scenes_of(entry: ScanEntry, place: Path | None, role: str, most_points: int) -> Iterator[ScannedScene]:
    """Yield the scenes that the `role` of a run sees, their scans thinned at random to `most_points`."""
    if entry.kind == "virtual":
        from gpca.scans import virtual  # loads trimesh, which nothing needs that plans a run

        found: Iterator[ScannedScene] = virtual.scenes(entry.rooms, entry.objects, entry.views, role == DEVELOPMENT)
    elif place is None:
        raise InputError(entry.title, "its data is not there", "set data_dir")
    else:
        develops = role == DEVELOPMENT
        found = (each for each in READERS[entry.kind](entry, place) if (each.name in entry.development) == develops)
    empty = True
    for scene in found:
        empty = False
        scans = dict(scene.scans)
        for name, scan in scene.scans.items():
            if len(scan.points_N_3) > most_points:
                order = generator("scans", scene.name, name, "points").permutation(len(scan.points_N_3))
                scans[name] = replace(scan, points_N_3=scan.points_N_3[np.sort(order[:most_points])])
        yield replace(scene, family=entry.families.get(scene.name, ""), scans=scans)
    if empty:
        raise InputError(place or entry.title, f"has no scene for {role}", "correct development in the entry")
