"""The configuration of a run: checked once, when the workflow loads, so that a mistake stops it with one line."""

from __future__ import annotations

from collections.abc import Mapping

from gpca.config.checks.explainers import (
    check_encoders,
    check_explainers,
    check_registrations,
    check_tolerances,
)
from gpca.config.checks.left_out import check_left_out
from gpca.config.checks.places import check_places
from gpca.config.checks.sizes import check_sizes
from gpca.config.checks.sources import check_named_sources, resolve_sources
from gpca.config.command_line import with_types
from gpca.config.layers import with_defaults
from gpca.config.leave_out import names_left_out, without_false
from gpca.config.schema import whole_config
from gpca.experiments.registry import experiments
from gpca.io.structured_text import require_plain
from gpca.settings import read_settings


def read(config: dict, command_line: Mapping, of_module: bool = False) -> tuple[dict, dict[str, dict]]:
    """Read the config of a run as Snakemake merged it.

    Args:
        command_line: what was given with ``--config``, whose numbers are text yet.
        of_module: it is what another workflow gives this one as a module, so that the defaults are not below it yet.

    Returns:
        the config of this run, without what it leaves out; the sources that :func:`check` returns.

    Raises:
        InputError: what :func:`check` raises.
    """
    given = with_types(with_defaults(config) if of_module else config, command_line)
    sources = check(given)
    return without_false(given), sources


def check(config: dict) -> dict[str, dict]:
    """Check a configuration against the schema and against what exists.

    Args:
        config: as it was given; what it leaves out with ``false`` is not checked, and it stays as it is.

    Returns:
        the resolved entry of every source, by name, with ``stand_in`` set.

    Raises:
        InputError: unknown key, wrong type, value out of range; unknown source, family, kind, explainer or backbone,
            or one that is left out; data that is neither in its folder nor downloadable. The line names the key.
    """
    require_plain(config, "config key")
    whole = without_false(config)
    read_settings(whole_config(), whole, "config key")
    encoders, designs, sources = (names_left_out(config, key) for key in ("encoders", "uncertainty", "sources"))
    check_left_out(config)
    check_places(whole)
    check_registrations(whole)
    check_encoders(whole, encoders)
    check_explainers(whole, designs)
    check_tolerances(whole)
    check_sizes(whole)
    for experiment in experiments():
        experiment.check(whole, lambda key: names_left_out(config, key))
    resolved = resolve_sources(whole)
    check_named_sources(whole, sources, encoders)
    return resolved
