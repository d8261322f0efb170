"""`python -m pipelines`."""

import sys

from pipelines.endings import Stopped, listen, listen_no_more, say_stopped


def main() -> int:
    """Run the command line; a signal at any moment, imports included, is one sentence."""
    try:
        listen()
        from pipelines.cli import main as run

        return run()
    except Stopped as stop:
        return say_stopped(stop.number)
    finally:
        listen_no_more()


if __name__ == "__main__":
    sys.exit(main())
