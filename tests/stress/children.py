"""Detectors in processes of their own, one at a time, ended when they take too long."""

from __future__ import annotations

import multiprocessing
import time

from tests.stress import answers

LIMIT_S = 5.0  # of processor time, for one picture
SLOWDOWN = 8.0  # by which a crowded machine may stretch it
START_S = 600.0  # for imports and kernels that are compiled at first use


class Child:
    """One process that answers for one detector."""

    def __init__(self, detector, warm_up):
        self.detector = detector
        self._warm_up = warm_up  # (image, board)
        self._process = None

    def ask(self, image, board):
        """(answer, processor seconds); (None, the limit) if it took too long or died."""
        if self._process is None:
            self._start()
        return self._send(image, board, LIMIT_S * SLOWDOWN)

    def close(self):
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None

    def _start(self):
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, self.detector), daemon=True)
        self._process.start()
        other.close()
        self._send(*self._warm_up, START_S)

    def _send(self, image, board, seconds):
        self._pipe.send((image, board))
        try:
            if self._pipe.poll(seconds):
                return self._pipe.recv()
        except EOFError:
            pass
        self.close()
        return None, LIMIT_S


def _serve(pipe, detector):
    import resource

    import cv2

    cv2.setNumThreads(1)
    while True:
        image, board = pipe.recv()
        # The system ends a process that computes for longer.
        used = int(time.process_time())
        resource.setrlimit(resource.RLIMIT_CPU, (used + int(LIMIT_S) + 2 if used > 1 else int(START_S), -1))
        start = time.process_time()
        found = answers.answer(detector, image, board)
        pipe.send((found, time.process_time() - start))
