"""Errors of an object's pose: ADD or ADD-S, the angle up to the symmetries, the shift of its center."""

import numpy as np

from gpca.alignment.pose_error import JUDGED_POINTS, PoseErrors
from gpca.errors import InputError
from gpca.objects.bop import angle_up_to_symmetry, find_symmetries
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.rigid import inverse


class Judge:
    """Judges poses of one object, in diameters, by ADD, or by ADD-S where a turn leaves its shape as it is."""

    def __init__(self, objects: ObjectClouds, index: int) -> None:
        diameter_m = float(objects.diameters_m[index])
        self.symmetries = find_symmetries(objects.points(index), diameter_m)
        self.symmetric = bool(self.symmetries)
        self._add = PoseErrors(objects.points(index).astype(np.float64) / diameter_m, JUDGED_POINTS, self.symmetric)

    def __call__(self, T_target_source: np.ndarray, T_target_source_true: np.ndarray) -> dict[str, float]:
        """Return the errors of a pose by the names of their columns."""
        T_off = T_target_source @ inverse(T_target_source_true)  # moves the object from where it is
        return {
            "add_relative": float(self._add(T_off[None])[0]),
            "rotation_error_rad": angle_up_to_symmetry(T_off[:3, :3], self.symmetries),
            "translation_error": float(np.linalg.norm(T_off[:3, 3])),
        }


class Judges:
    """The judge of each object, made when it is first asked for; `subject` names the objects in a message."""

    def __init__(self, objects: ObjectClouds, subject: str) -> None:
        self._objects, self._subject, self._made = objects, subject, dict[int, Judge]()

    def of(self, registrations: Registrations, row: int) -> Judge:
        """Return the judge of a registration's object; InputError where the objects have another one in its place."""
        index, name = int(registrations.object_index[row]), str(registrations.object_name[row])
        if index >= len(self._objects) or str(self._objects.names[index]) != name:
            fault = f"object {index} is not '{name}', as in the registrations"
            raise InputError(self._subject, fault, "give the objects that the registrations were made from")
        if index not in self._made:
            self._made[index] = Judge(self._objects, index)
        return self._made[index]
