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
from gpca.settings import Bounds, Count, read_settings
from gpca.uncertainty.settings import UncertaintySettings


@dataclass(frozen=True)
class LoopSettings:
    """Settings of the loop."""

    failures: Count = 8  # per cause
    good: Count = 8  # registrations per cause
    tries: Count = 120  # largest number of situations that are registered to find them, per cause
    budget: Annotated[int, Bounds(minimum=1, maximum=9)] = 3  # actions per failure
    success: float = SuccessSettings.error  # of the pose, above which a registration failed, in diameters
    cloud_points: int = 2048  # of source and target
    icp: ICPSettings = field(default_factory=ICPSettings)


@dataclass(frozen=True)
class RecoverySettings:
    """All settings of a run of the closed loop."""

    section: Mapping  # the config's section ``recovery``
    objects: Mapping  # entry of the source of the objects on the tables
    loop: LoopSettings
    situation: SituationSettings  # disturbances of the registrations, and scenes
    encoder: EncoderSettings  # shared by the explainers, as is
    uncertainty: UncertaintySettings
    explainers: Mapping[str, Mapping]  # settings of each by name
    reenactment: ReenactmentSettings  # search for the true pose
    counterfactuals: CauseSettings  # registrations under each hypothesis

    @classmethod
    def from_sections(cls, sections: Mapping[str, dict]) -> RecoverySettings:
        """Build from the sections of the config, ``explainers`` and ``reenactment`` by name."""
        recovery, success = sections["recovery"], sections["success"]["error"]
        registration = read_settings(RegistrationSettings, sections["registrations"])
        camera, icp = Camera(**recovery["camera"]), registration.icp
        scenes = replace(read_settings(SceneSettings, sections["scenes"]), count=recovery["tables"], camera=camera)
        ranges = tuple(recovery["noise_scale"]), tuple(recovery["hidden"])
        limits = Limits(min(Limits.nominal, success), success)
        return cls(
            section=recovery,
            objects=sections["objects"],
            loop=LoopSettings(**recovery["loop"], success=success, cloud_points=registration.cloud_points, icp=icp),
            situation=SituationSettings(scenes, *ranges, severities=registration.severities),
            encoder=EncoderSettings(**sections["encoder"]),
            uncertainty=UncertaintySettings(**sections["uncertainty"], icp=icp),
            explainers=sections.get("explainers", {}),
            reenactment=ReenactmentSettings(**sections.get("reenactment", {})),
            counterfactuals=CauseSettings(icp=icp, moved=OBSERVED, limits=limits),
        )
