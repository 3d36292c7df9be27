"""The model file: everything needed to explain a registration, in one file that can be handed on.

It holds tensors, numbers and names alone, so that loading one runs nobody's code.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from torch import nn

from gpca.alignment.icp import ICPSettings
from gpca.classifier.gpc import GPC
from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.encoders.tensor_file import read_tensors, write_tensors
from gpca.errors import InputError
from gpca.model.card import titles_of_diagnosis
from gpca.model.contents import require_possible
from gpca.model.diagnoser import Diagnoser
from gpca.model.familiarity import Familiarity
from gpca.model.location import REMEDY, require_model
from gpca.recovery.policy import RecoveryPolicy, Thresholds

FORMAT, VERSION = "GP-CA model", 4
WITHOUT_REENACTMENT = 3  # the version whose diagnosis reads registrations with remedies; it says less


@dataclass(frozen=True)
class Model:
    """A diagnoser, which says whether a registration is right and why it is not, and the paper's GP-CA.

    Attributes:
        diagnoser: of the pair after ICP, learned from measured causes of all sources; None where there is GP-CA alone.
        encoder: from clouds (B, N, 3) to embeddings (B, d), ready for inference.
        encoder_settings: also how many points it sees and how many draws make an embedding.
        gpc: the classifier; its classes are the concepts.
        icp: how ICP ran.
        cloud_points: of source and of target, at most.
        policy: the actions for the causes.
        title, stand_in: of the objects that GP-CA learned, and whether they were drawn by the package.
        familiar: ranges of simple measures of the clouds that GP-CA learned; None in older files.
        learned_from: titles of the objects that the diagnosis learned from; empty where nothing says so.
    """

    diagnoser: Diagnoser | None
    encoder: nn.Module
    encoder_settings: EncoderSettings
    gpc: GPC
    icp: ICPSettings
    cloud_points: int
    policy: RecoveryPolicy
    title: str
    stand_in: bool
    familiar: Familiarity | None = None
    learned_from: tuple[str, ...] = ()

    @property
    def concepts(self) -> tuple[str, ...]:
        """Names of the causes that it tells apart, in the order of the scores."""
        return self.gpc.classes

    @property
    def learning(self) -> str:
        """What all of it was learned from, in words."""
        paper = f"{self.title} (procedural stand-in)" if self.stand_in else self.title
        if self.diagnoser is None:
            return f"GP-CA as in the paper learned from {paper}; there is no diagnosis"
        objects = ", ".join(self.learned_from) or "objects that the model file does not name"
        return f"the diagnosis learned from {objects}; GP-CA as in the paper from {paper}"

    def save(self, path: str | Path) -> None:
        """Write the file; the same model gives the same bytes."""
        content = {
            "format": FORMAT,
            "version": VERSION,
            "diagnoser": self.diagnoser and self.diagnoser.state(),
            "encoder": self.encoder.state_dict(),
            "encoder_settings": _renamed(
                {k: v for k, v in asdict(self.encoder_settings).items() if v is not None}, "draw_points", "points"
            ),
            "gpc": self.gpc.state(),
            "icp": asdict(self.icp),
            "points": self.cloud_points,
            "thresholds": asdict(self.policy.thresholds),
            "treatments": dict(self.policy.treatments),
            "title": self.title,
            "stand_in": self.stand_in,
        }
        if self.familiar is not None:
            content["familiar"] = {name: list(ends) for name, ends in self.familiar.ranges.items()}
        if self.learned_from:
            content["learned_from"] = list(self.learned_from)
        write_tensors(path, content)

    @classmethod
    def load(cls, path: str | Path) -> Model:
        """Read the file.

        Raises:
            InputError: missing, damaged, pickled, no model, one of another version, or one with what cannot be.
        """
        require_model(path)
        try:
            content = read_tensors(path)
        except ValueError as fault:
            raise InputError(path, f"is damaged or not a model ({fault})", REMEDY) from fault
        except Exception as fault:  # torch raises errors of many kinds for a damaged or foreign file
            raise InputError(path, "is damaged or not a model", REMEDY) from fault
        if not isinstance(content, Mapping) or content.get("format") != FORMAT:
            raise InputError(path, "is not a model", REMEDY)
        if (version := content.get("version")) not in (WITHOUT_REENACTMENT, VERSION):
            raise InputError(path, f"is a model of version {version}, not {VERSION}", REMEDY)
        try:
            settings = EncoderSettings(**_renamed(content["encoder_settings"], "points", "draw_points"))
            require_possible(content, settings)
            familiar = content.get("familiar")
            encoder = make_encoder(settings.backbone, settings.options)
            encoder.load_state_dict(content["encoder"])
            return cls(
                diagnoser=content["diagnoser"] and Diagnoser.from_state(content["diagnoser"]),
                encoder=encoder.eval(),
                encoder_settings=settings,
                gpc=GPC.from_state(content["gpc"]),
                icp=ICPSettings(**content["icp"]),
                policy=RecoveryPolicy(Thresholds(**content["thresholds"]), dict(content["treatments"])),
                cloud_points=content["points"],
                familiar=familiar and Familiarity({name: (low, high) for name, (low, high) in familiar.items()}),
                learned_from=tuple(content.get("learned_from", ())) or titles_of_diagnosis(Path(path)),
                **{name: content[name] for name in ("title", "stand_in")},
            )
        except (LookupError, TypeError, ValueError, RuntimeError, AttributeError) as fault:
            raise InputError(path, f"is a model with missing or damaged parts ({fault})", REMEDY) from fault


def _renamed(settings: Mapping, old: str, new: str) -> dict:
    """Rename one setting in its place: files of this version say `points`, whatever the config calls it now."""
    return {new if name == old else name: value for name, value in settings.items()}
