"""Checks of the section ``exchange``: what is exchanged exists, and every explainer takes its settings and reads it."""

from __future__ import annotations

from collections.abc import Set

from baselines.registry import require_settings
from gpca.config.checks.named import require_names, with_key
from gpca.exchange.asked import require_exchangeable
from gpca.settings import check_settings


def check_exchange(config: dict, sources_left_out: Set[str], methods_left_out: Set[str], estimators_left_out: Set[str]):
    """Check the names; as under controls, an explainer's settings add to those that it has as an explainer."""
    exchange = config["exchange"]
    require_names("exchange.sources", exchange["sources"], config["sources"], "source", sources_left_out)
    require_names("exchange.methods", exchange["methods"], config["methods"], "registration method", methods_left_out)
    require_names("exchange.estimators", exchange["estimators"], config["estimators"], "estimator", estimators_left_out)
    for name, settings in exchange["explainers"].items():
        key = f"exchange.explainers.{name}"
        own = (config["explainers"].get(name) or {}) | (settings or {})
        with_key(key, require_settings, name, own)
        with_key(key, check_settings, own, "explainers", name)
        with_key(key, require_exchangeable, name)
