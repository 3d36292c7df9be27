"""Encoders are listed by ``module:class``, so that torch is loaded by those who train one alone."""

ENCODERS = {"my_pointwise": "my_gpca_plugin.pointwise:Pointwise"}
