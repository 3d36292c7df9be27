"""A fixture for tests that bring code from outside: none of it is left behind."""

import sys

import pytest

from gpca.process import plugins
from gpca.process.code_files import ROOT, _imports


def forget():
    plugins._announced.cache_clear()
    _imports.cache_clear()


@pytest.fixture
def apart(monkeypatch):
    """No plugin is known, and those that the test brings are forgotten at its end."""
    monkeypatch.setenv(plugins.NAMED, "[]")
    monkeypatch.setattr(sys, "path", list(sys.path))
    roots, modules = dict(plugins.ROOTS), set(sys.modules)
    forget()
    yield
    for name in set(sys.modules) - modules:
        file = getattr(sys.modules[name], "__file__", None) or ""
        if not file.startswith((str(ROOT), sys.prefix, sys.base_prefix)):
            del sys.modules[name]
    plugins.ROOTS.clear()
    plugins.ROOTS.update(roots)
    forget()
