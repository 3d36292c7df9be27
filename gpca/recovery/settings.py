"""Settings of the closed loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import SuccessSettings
from gpca.causes.settings import OBSERVED, CauseSettings, Limits
from gpca.encoders.registry import EncoderSettings
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.situations import SituationSettings
from gpca.objects.camera import Camera
from gpca.pairs.synthesis import RegistrationSettings
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import Bounds, Count
from gpca.uncertainty.settings import UncertaintySettings


@dataclass(frozen=True)
class LoopSettings:
    """Settings of the loop.

    Attributes:
        failures, good: number of failed and of good registrations per cause.
        tries: largest number of situations that are registered to find them, per cause.
        budget: number of actions per failure.
        success: error of the pose above which a registration failed, in diameters.
        cloud_points: number of points of source and target.
        icp: settings of ICP.
    """

    failures: Count = 8
    good: Count = 8
    tries: Count = 120
    budget: Annotated[int, Bounds(minimum=1, maximum=9)] = 3
    success: float = SuccessSettings.error
    cloud_points: int = 2048
    icp: ICPSettings = field(default_factory=ICPSettings)


@dataclass(frozen=True)
class RecoverySettings:
    """All settings of a run of the closed loop.

    Attributes:
        section: the config's section ``recovery``.
        objects: entry of the source of the objects on the tables.
        loop: settings of the loop.
        situation: disturbances of the registrations, and scenes.
        encoder, uncertainty: shared by the explainers.
        explainers: settings of each explainer by name.
        reenactment: search for the true pose.
        counterfactuals: registrations under each hypothesis.
    """

    section: Mapping
    objects: Mapping
    loop: LoopSettings
    situation: SituationSettings
    encoder: EncoderSettings
    uncertainty: UncertaintySettings
    explainers: Mapping[str, Mapping]
    reenactment: ReenactmentSettings
    counterfactuals: CauseSettings

    @classmethod
    def from_sections(cls, sections: Mapping[str, dict]) -> RecoverySettings:
        """Build from the sections of the config, ``explainers`` and ``reenactment`` by name."""
        recovery, success = sections["recovery"], sections["success"]["error"]
        registration = RegistrationSettings.from_dict(sections["registrations"])
        scenes = SceneSettings.from_dict(sections["scenes"])
        return cls(
            section=recovery,
            objects=sections["objects"],
            loop=LoopSettings(
                **recovery["loop"],
                success=success,
                cloud_points=registration.cloud_points,
                icp=registration.icp,
            ),
            situation=SituationSettings(
                replace(scenes, count=recovery["tables"], camera=Camera(**recovery["camera"])),
                noise_scale=tuple(recovery["noise_scale"]),
                hidden=tuple(recovery["hidden"]),
                severities=registration.severities,
            ),
            encoder=EncoderSettings(**sections["encoder"]),
            uncertainty=UncertaintySettings(**sections["uncertainty"], icp=registration.icp),
            explainers=sections.get("explainers", {}),
            reenactment=ReenactmentSettings(**sections.get("reenactment", {})),
            counterfactuals=CauseSettings(
                icp=registration.icp, moved=OBSERVED, limits=Limits(min(Limits.nominal, success), success)
            ),
        )
