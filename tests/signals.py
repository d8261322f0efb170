"""Signals of the processes that tests start."""

import signal


def heed_signals():
    """In a new process: no signal is ignored, as `nohup` and a shell's background jobs leave some to their children."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_DFL)


def noted_signals():
    """The signals that come from now on, which end nothing: who runs many cases tells what there was, and ends."""
    came = []
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda got, _: came.append(got))
    return came
