from gpca.causes.judged import *  # noqa: F403
