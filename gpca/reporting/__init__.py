"""Makes tables and figures from files, in one style, and computes no result.

Names stand in the order in which they are shown, and those without numbers are left out. An
:class:`gpca.errors.InputError` says that nothing is left, or that a file is unusable or of another run.
"""
