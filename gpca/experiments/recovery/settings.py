"""The section ``recovery`` of the config: a robot's policies after a failed registration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from gpca.encoders.registry import EncoderChanges
from gpca.frames.camera import Camera
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.objects.entry import SurfacePoints
from gpca.pairs.perturbation import CONCEPTS, Hidden
from gpca.pairs.synthesis import TestSamples, TrainSamples
from gpca.recovery.settings import LoopSettings
from gpca.settings import Bounds, Count, Distinct, Keys, NotNegative, Share, changes_of, part_of


@dataclass(frozen=True)
class DeclaredThresholds:
    """When a policy takes which branch; without `uncertain` the calibration samples set it, by `queued_share`."""

    uncertain: NotNegative | None
    queued_share: Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]
    dominant: Share
    improvement: Share


@dataclass(frozen=True)
class Gate:
    """How many of the good registrations gated policies may act on."""

    false_alarms: Annotated[float, Bounds(exclusiveMinimum=0, exclusiveMaximum=1)]


@dataclass(frozen=True)
class Estimator(InitialPoseSettings):
    """The settings of the robot's pose estimate."""

    form: Literal["global_registration"] = "global_registration"


@dataclass(frozen=True)
class RecoverySettings:
    """Recovery from failed registrations, in a closed loop on tables of the virtual camera."""

    objects: str
    policies: Distinct[str]
    treatments: Annotated[dict, Keys(dict.fromkeys(CONCEPTS, str), required=CONCEPTS)]
    actions: Annotated[dict[str, dict | None], Field(min_length=1)]  # an action checks its settings itself
    costs: dict[str, Share]
    needless: Share
    thresholds: DeclaredThresholds
    gate: Gate
    rehearsals: Count
    loop: Annotated[dict, part_of(LoopSettings, without=("success", "cloud_points", "icp"))]
    train: TrainSamples
    calibration: TestSamples
    remedied: TestSamples
    tables: Count
    camera: Camera
    noise_scale: tuple[NotNegative, NotNegative]
    hidden: tuple[Hidden, Hidden]
    estimator: Annotated[dict, changes_of(Estimator, without=("rotation_deg", "translation"))]
    model_points: SurfacePoints
    encoder: EncoderChanges
