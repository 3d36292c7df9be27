"""The commands of ``gpca``: each module has ``add_…_arguments`` and ``run_…`` for every command in it."""
