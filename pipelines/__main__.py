"""`python -m pipelines`."""

import os
import sys

from pipelines.endings import Stopped, listen, listen_no_more, say_stopped


def main() -> int:
    """Run the command line; a signal at any moment, imports included, is one sentence."""
    try:
        listen()
        # NumPy's linear algebra reads it when it is loaded, in workers, too. These matrices are small: a second thread
        # waits for them busily and takes as much processor time again, which other workers could use.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        from pipelines.cli import main as run

        return run()
    except Stopped as stop:
        return say_stopped(stop.number)
    finally:
        listen_no_more()


if __name__ == "__main__":
    sys.exit(main())
