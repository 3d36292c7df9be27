"""What the closed loop reads of the config, as settings of the library's own classes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

from gpca.alignment.icp import ICPSettings
from gpca.encoders.settings import EncoderSettings
from gpca.errors import InputError
from gpca.frames.camera import Camera
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.situations import SituationSettings
from gpca.pairs.synthesis import RegistrationSettings
from gpca.settings import Bounds, Count, check_settings
from gpca.uncertainty.settings import UncertaintySettings

SECTIONS = {
    "recovery": ("recovery",),
    "objects": ("sources", "*"),
    "scenes": ("real_world", "scenes"),
    "registrations": ("registrations",),
    "encoder": ("encoders", "*"),
    "uncertainty": ("uncertainty", "*"),
}


@dataclass(frozen=True)
class LoopSettings:
    """How the closed loop runs.

    Attributes:
        failures: how many are wanted for each cause.
        tries: how many situations may be registered to find them, for each cause.
        budget: how many actions each failure may take.
        cloud_points: how many source and target have.
        icp: how ICP runs.
    """

    failures: Count = 8
    tries: Count = 120
    budget: Annotated[int, Bounds(minimum=1, maximum=9)] = 3
    cloud_points: int = 2048
    icp: ICPSettings = field(default_factory=ICPSettings)


@dataclass(frozen=True)
class RecoverySettings:
    """All settings of a run of the closed loop.

    Attributes:
        section: the config's section ``recovery``, for all that it hands on as it is.
        objects: the entry of the source whose objects lie on the tables.
        loop: how the loop runs.
        situation: what disturbs the registrations, and on which scenes.
        encoder, uncertainty: what the explainers share.
        explainers: the settings of each explainer by its name.
    """

    section: Mapping
    objects: Mapping
    loop: LoopSettings
    situation: SituationSettings
    encoder: EncoderSettings
    uncertainty: UncertaintySettings
    explainers: Mapping[str, Mapping]

    @classmethod
    def from_sections(cls, given: Mapping[str, dict]) -> RecoverySettings:
        """Build from the sections of the config that `SECTIONS` names, and from ``explainers``.

        Raises:
            InputError: a section is missing, or holds an unknown setting or a value out of range.
        """
        for part, path in SECTIONS.items():
            if part not in given:
                raise InputError("--settings", f"has no section '{part}'", "see workflow/rules/recovery.smk")
            check_settings(given[part], *path)
        recovery = given["recovery"]
        registration = RegistrationSettings.from_dict(given["registrations"])
        scenes = SceneSettings.from_dict(given["scenes"])
        return cls(
            section=recovery,
            objects=given["objects"],
            loop=LoopSettings(**recovery["loop"], cloud_points=registration.cloud_points, icp=registration.icp),
            situation=SituationSettings(
                replace(scenes, count=recovery["tables"], camera=Camera(**recovery["camera"])),
                noise_scale=tuple(recovery["noise_scale"]),
                hidden=tuple(recovery["hidden"]),
                severities=registration.severities,
            ),
            encoder=EncoderSettings(**given["encoder"]),
            uncertainty=UncertaintySettings(**given["uncertainty"], icp=registration.icp),
            explainers=given.get("explainers", {}),
        )
