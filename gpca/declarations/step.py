"""A step of an experiment: from its declaration, the workflow makes the rule that runs it.

In the patterns of files, a name in braces is a wildcard, with a job for each of its values; ``{*name}`` stands for all
values in one job, which is given them as a list under the plural of the name; and a name with a single value, such as
``{frames}``, is replaced by it. Values are those of :func:`gpca.experiments.run.names_of`.
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import product
from operator import getitem
from pathlib import Path
from typing import Any

from gpca.declarations.plan import Run
from gpca.encoders.registry import encoders

BRACED = re.compile(r"{(\*?)(\w+)}")
Wildcards = Any
Settings = tuple[str, ...] | Callable[["Plan", Wildcards], Mapping[str, Any]]
Files = str | Sequence[str] | Callable[["Plan", Wildcards], str | Sequence[str]]


@dataclass(frozen=True)
class Plan:
    """What rules are made from: a run, its names, and the sources that its config and its rules define."""

    run: Run
    names: Mapping[str, Any]
    sources: Mapping[str, Mapping]

    @property
    def config(self) -> Mapping[str, Any]:
        """The config of the run."""
        return self.run.config

    @property
    def encoder(self) -> Mapping[str, Any]:
        """Settings of the encoder that GP-CA reads."""
        return self.config["encoders"][self.config["embedding"]["encoder"]]

    @property
    def encoder_module(self) -> str:
        """The module of its backbone."""
        return encoders()[self.encoder["backbone"]].split(":")[0]


@dataclass(frozen=True, kw_only=True)
class Step:
    """The declaration of a step; functions get the plan and the wildcards of a job."""

    name: str  # of its rule
    run: str  # ``module:function``, or a module with a function ``run``, that gets the job
    outputs: Mapping[str, str | Sequence[str]]  # argument of the job -> patterns of files below the folder of a run
    inputs: Mapping[str, Files] = field(default_factory=dict)  # likewise, or functions that return patterns
    # Files from outside the run, which the job gets as ``data``.
    data: Callable[[Plan, Wildcards], Iterable[str | Path]] | None = None
    settings: Settings = ()  # keys of the config, with dots, that the job is given by these names; or a function
    params: Mapping[str, Any] = field(default_factory=dict)  # further arguments of the job, or functions
    # Modules chosen at run time, which count as code of the step: those of all jobs, and those that a job chooses.
    modules: Callable[[Plan], Iterable[str]] = lambda plan: ()
    modules_of_job: Callable[[Plan, Wildcards], Iterable[str]] | None = None
    where: Mapping[str, str] = field(default_factory=dict)  # wildcard or listed name -> name of its values, if another
    target: str = ""  # name of the rule that asks for all outputs, if there is one
    when: Callable[[Plan], bool] = lambda plan: True  # whether a run has the step
    priority: int = 0  # of its jobs, as all that follows
    threads: int = 1
    resources: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Rule:
    """What a rule needs besides its step, in the words of Snakemake; files are below the folder of a run."""

    inputs: dict[str, Any]
    data: dict[str, Any]  # inputs from outside the run
    modules: Any  # of its code
    outputs: dict[str, Any]
    settings: Any
    params: dict[str, Any]
    constraints: dict[str, str]
    place: str  # of its log and its benchmark


def plural(name: str) -> str:
    """Argument of a job that holds a list: ``methods``, ``strategies``."""
    return f"{name[:-1]}ies" if name.endswith("y") else f"{name}s"


def all_files(step: Step, plan: Plan) -> list[str]:
    """All outputs of a step, for all values of its wildcards."""
    patterns = [each for outputs in step.outputs.values() for each in _listed(outputs)]
    return [file for pattern in patterns for file in _expanded(step, plan, BRACED.sub(r"{*\2}", pattern))]


def rule_of(step: Step, plan: Plan) -> Rule:
    """The rule of a step."""
    patterns = [each for outputs in step.outputs.values() for each in _listed(outputs)]
    in_outputs = dict.fromkeys(found for each in patterns for found in BRACED.findall(each))
    values = {wildcard: plan.names.get(step.where.get(wildcard, wildcard)) for _, wildcard in in_outputs}
    wildcards = [wildcard for star, wildcard in in_outputs if not star and not isinstance(values[wildcard], str)]
    modules = (step.run, *step.modules(plan))

    def later(function: Callable, *given: Any) -> Callable[[Wildcards], Any]:
        return lambda wildcards: function(*given, wildcards)

    return Rule(
        inputs={
            key: later(_resolved, step, plan, files) if callable(files) else _files(step, plan, files)
            for key, files in step.inputs.items()
        },
        data={"data": lambda wildcards: [*map(str, step.data(plan, wildcards))]} if step.data else {},
        modules=(lambda wildcards: (*modules, *step.modules_of_job(plan, wildcards)))
        if step.modules_of_job
        else modules,
        outputs={key: _files(step, plan, pattern) for key, pattern in step.outputs.items()},
        settings=later(_as_json, step, plan) if callable(step.settings) else _as_json(step, plan, None),
        params={plural(listed): list(values[listed] or ()) for star, listed in in_outputs if star}
        | {key: later(value, plan) if callable(value) else value for key, value in step.params.items()},
        constraints={
            wildcard: "|".join(map(str, values[wildcard] or ())) or "none"
            for wildcard in wildcards
            if wildcard != "seed" and values[wildcard] is not None
        },
        place="/".join([step.name, *(f"{{{wildcard}}}" for wildcard in wildcards)]),
    )


def _listed(patterns: str | Sequence[str]) -> Sequence[str]:
    return [patterns] if isinstance(patterns, str) else patterns


def _files(step: Step, plan: Plan, patterns: str | Sequence[str]) -> str | list[str]:
    """Patterns with their lists filled in; one path where there is one pattern without a list."""
    files = [file for pattern in _listed(patterns) for file in _expanded(step, plan, pattern)]
    return files[0] if isinstance(patterns, str) and "{*" not in patterns else files


def _expanded(step: Step, plan: Plan, pattern: str) -> list[str]:
    names = list(dict.fromkeys(name for star, name in BRACED.findall(pattern) if star))
    values = (plan.names[step.where.get(name, name)] for name in names)
    files = []
    for chosen in product(*([each] if isinstance(each, str) else each for each in values)):
        by_name = dict(zip(names, chosen, strict=True))

        def filled(match: re.Match, by_name: Mapping[str, Any] = by_name) -> str:
            star, name = match.groups()
            value = by_name.get(name) if star else plan.names.get(step.where.get(name, name))
            return str(value) if star or isinstance(value, str) else match[0]

        files.append(BRACED.sub(filled, pattern))
    return files


def _resolved(step: Step, plan: Plan, files: Callable, wildcards: Wildcards) -> str | list[str]:
    given, by_name = files(plan, wildcards), dict(wildcards.items())
    paths = [path.format(**by_name) for pattern in _listed(given) for path in _expanded(step, plan, pattern)]
    return paths[0] if isinstance(given, str) and "{*" not in given else paths


def _as_json(step: Step, plan: Plan, wildcards: Wildcards) -> str:
    if callable(step.settings):
        settings = step.settings(plan, wildcards)
    else:
        settings = {key.rpartition(".")[2]: reduce(getitem, key.split("."), plan.config) for key in step.settings}
    return json.dumps(settings, sort_keys=True)
