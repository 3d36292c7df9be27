"""Settings of the samples that are unlike those of the training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.encoders.registry import EncoderSettings
from gpca.pairs.synthesis import RegistrationSettings
from gpca.settings import Bounds, Count, OpenShare


@dataclass(frozen=True)
class ShiftSettings:
    """The number of samples, how unlike the training they are, and how the distances are measured.

    Attributes:
        beyond: how the registrations with larger severities are made; their number is `beyond.test`.
        encoder: how the encoder that never sees some objects is trained.
        samples: the most samples of another source, and of objects that an encoder never saw.
        held_out_share: of the objects, at least one, that this encoder and the learners on it never see.
        train: training samples of that encoder, at most.
        neighbours: of the mean distance to the nearest training samples.
        shape_points: at which the local shape of a cloud is measured for the distances.
    """

    beyond: RegistrationSettings
    encoder: EncoderSettings
    samples: Annotated[int, Bounds(minimum=3)] = 90
    held_out_share: OpenShare = 0.2
    train: Annotated[int, Bounds(minimum=3)] = 300
    neighbours: Count = 10
    shape_points: Annotated[int, Bounds(minimum=4)] = 128

    @classmethod
    def from_dicts(cls, shift: dict, registrations: dict, encoder: dict) -> ShiftSettings:
        """Build from the config's section ``shift``, and what it shares with the registrations and the encoder."""
        shift = dict(shift)
        samples = shift.get("samples", cls.samples)
        severities = shift.pop("severities", {})
        beyond = RegistrationSettings.from_dict(registrations | {"severities": severities, "train": 0, "test": samples})
        trained = EncoderSettings(**encoder | shift.pop("encoder", {}))
        return cls(beyond=beyond, encoder=trained, **shift)
