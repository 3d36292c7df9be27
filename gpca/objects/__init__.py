"""Kinds of object sources. Each module yields surfaces; :mod:`gpca.objects.canonical` turns them into clouds."""
