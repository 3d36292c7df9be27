"""The configuration of a run: checked once, when the workflow loads, so that a mistake stops it with one line."""

from __future__ import annotations

from collections.abc import Mapping

from gpca.config.checks import check_shared, resolve_sources
from gpca.config.command_line import with_types
from gpca.config.layers import with_defaults
from gpca.config.leave_out import check_left_out, names_left_out, without_false
from gpca.config.schema import whole_config
from gpca.experiments.registry import experiments
from gpca.io.structured_text import require_plain
from gpca.settings import read_settings


def read(config: dict, command_line: Mapping, of_module: bool = False) -> tuple[dict, dict[str, dict]]:
    """Read the config of a run as Snakemake merged it.

    Args:
        command_line: the values given with ``--config``, whose numbers are still text.
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
    """Check a configuration against its settings classes and against what exists.

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
    check_left_out(config)

    def left_out(key: str) -> set[str]:
        return names_left_out(config, key)

    check_shared(whole, left_out)
    for experiment in experiments():
        experiment.check(whole, left_out)
    return resolve_sources(whole)
