"""A fixture for tests that bring code from outside: none of it is left behind."""

import sys

import pytest

from gpca.process import plugins
from gpca.process.code_files import ROOT, _file, _imports


def forget():
    plugins._announced.cache_clear()
    _imports.cache_clear()
    _file.cache_clear()


def lies_outside(module):
    """Whether a file outside the checkout and the environment defines a module; C defines some, in no file at all."""
    places = [module.__file__] if getattr(module, "__file__", None) else getattr(module, "__path__", [])
    return any(not place.startswith((str(ROOT), sys.prefix, sys.base_prefix)) for place in places)


@pytest.fixture
def apart(monkeypatch):
    """No plugin is known, and those that the test brings are forgotten at its end."""
    monkeypatch.setenv(plugins.NAMED, "[]")
    monkeypatch.setattr(sys, "path", list(sys.path))
    roots, modules = dict(plugins.ROOTS), set(sys.modules)
    forget()
    yield
    for name in set(sys.modules) - modules:
        if lies_outside(sys.modules[name]):
            del sys.modules[name]
    plugins.ROOTS.clear()
    plugins.ROOTS.update(roots)
    forget()
