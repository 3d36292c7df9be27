"""Scenes in the layout of 3DMatch's benchmark (Zeng et al. 2017), which is that of Choi et al. 2015.

``<scene>/cloud_bin_<i>.ply`` are fragments, in ``fragments/`` or in the location itself. ``gt.log`` has five lines for
each pair: target, source, number of fragments, and the pose that takes the source into the target. It is looked for in
``<scene>/``, ``<scene>-evaluation/`` and ``gt_result/<scene>-evaluation/``. Beside it may lie ``gt_overlap.log`` with
lines ``target,source,overlap``, as Huang et al. 2021 have made for this benchmark and for 3DLoMatch.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import require_rigid, scale_translation
from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.numerals import decimal, whole
from gpca.objects.mesh_folder import meters_per, read_surface
from gpca.scans.entry import ScanEntry
from gpca.scans.scene import Known, Scan, Scene

LINES = 5  # of a pair in gt.log
REMEDY = "fetch the benchmark again"


def scenes(entry: ScanEntry, place: Path) -> Iterator[Scene]:
    """Yield the scene of each folder with fragments, by name.

    Raises:
        InputError: no such folder, no pairs, or what a file does not hold that it should.
    """
    folder = place / "fragments" if (place / "fragments").is_dir() else place
    found = sorted({path.parent for path in folder.glob("*/cloud_bin_*.ply")})
    if not found:
        raise InputError(folder, "has no <scene>/cloud_bin_<number>.ply", "correct location")
    scale = meters_per(entry.unit)
    for of_scene in found:
        log = _log_of(of_scene, place)
        shares = _read_overlaps(log.with_name("gt_overlap.log"))
        printed = tuple(
            Known(target, source, shares.get((target, source)), scale_translation(T, scale))
            for (target, source), T in read_log(log).items()
        )
        named = sorted({name for pair in printed for name in (pair.target, pair.source)}, key=int)
        viewpoint_3 = np.zeros(3) if entry.sensor_at_origin else None
        scans = {
            name: Scan(read_surface(of_scene / f"cloud_bin_{name}.ply", scale).vertices_m, None, viewpoint_3)
            for name in named
        }
        yield Scene(of_scene.name, entry.scenes or "room", scans, printed)


def _log_of(of_scene: Path, place: Path) -> Path:
    evaluation = f"{of_scene.name}-evaluation"
    folders = (of_scene, of_scene.with_name(evaluation), place / "gt_result" / evaluation)
    log = next((folder / "gt.log" for folder in folders if (folder / "gt.log").is_file()), None)
    if log is None:
        raise InputError(of_scene / "gt.log", "no such file", f"put it there, or into {evaluation} beside it")
    return log


def read_log(path: Path) -> dict[tuple[str, str], np.ndarray]:
    """Return ``T_target_source`` (4×4) of each pair of a ``gt.log``, by the numbers of target and source.

    Raises:
        InputError: no such file, other numbers than there should be, no rigid transform, a pair twice.
    """
    require_file(path, "no such file", REMEDY)
    lines = [line.split() for line in path.read_text("utf-8", errors="replace").splitlines() if line.strip()]
    if not lines or len(lines) % LINES:
        raise InputError(path, f"has {len(lines)} lines, not {LINES} for each pair", REMEDY)
    poses = {}
    for start in range(0, len(lines), LINES):
        (head, *rows), subject = lines[start : start + LINES], f"{path}, pair {start // LINES + 1}"
        try:
            if len(head) != 3 or any(len(row) != 4 for row in rows):
                raise ValueError("it has not 3 numbers and then 4 in each of 4 lines")
            target, source = (str(whole(word)) for word in head[:2])
            T_target_source = np.array([[decimal(word) for word in row] for row in rows])
        except ValueError as fault:
            raise InputError(subject, str(fault), REMEDY) from fault
        require_rigid(T_target_source, subject)
        if (target, source) in poses or target == source:
            raise InputError(subject, f"pairs {target} with {source} once more, or with itself", REMEDY)
        poses[target, source] = T_target_source
    return poses


def _read_overlaps(path: Path) -> dict[tuple[str, str], float]:
    """Return the overlap of each pair that a file prints; none where there is no file."""
    if not path.is_file():
        return {}
    shares = {}
    for number, line in enumerate(path.read_text("utf-8", errors="replace").splitlines(), 1):
        if not (words := line.replace(",", " ").split()):
            continue
        try:
            if len(words) != 3:
                raise ValueError(f"has {len(words)} numbers instead of target, source and overlap")
            target, source, share = str(whole(words[0])), str(whole(words[1])), decimal(words[2])
        except ValueError as fault:
            raise InputError(f"{path}, line {number}", str(fault), REMEDY) from fault
        if not 0 <= share <= 1:
            raise InputError(f"{path}, line {number}", f"the overlap {share:g} is no share", REMEDY)
        shares[target, source] = share
    return shares
