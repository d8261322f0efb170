"""Users' functions that end their process, hang, fork, print, or give what is no pose."""

from __future__ import annotations

import random

from tests.hostile.running import Call
from tests.wrong_input import Place

BODIES = (
    "import sys; sys.exit(3)",
    "import os; os._exit(0)",
    "import os; os.abort()",
    "while True: pass",
    "import time; time.sleep(1000)",
    "import os; os.kill(os.getpid(), 9)",
    "import os; os.kill(os.getpid(), 2)",
    "import ctypes; ctypes.string_at(0)",
    "raise KeyboardInterrupt",
    "raise SystemExit",
    "raise GeneratorExit",
    "raise BaseException('x' * 10**6)",
    "raise MemoryError",
    "def f(): return f()\n    f()",
    "raise Exception('\\ud800\\n\\x1b[31m')",
    "import os\n    if os.fork() == 0: return None\n    return None",
    "import os\n    os.fork()\n    while True: pass",
    "import os\n    os.fork()",
    "print('x' * 10**6)",
    "import sys; sys.stdout.close(); sys.stderr.close(); print('x')",
    "import os\n    for i in range(3, 50):\n        try: os.close(i)\n        except OSError: pass",
    "import os; os.closerange(0, 100)",
    "import os; os.dup2(1, 3)",
    "import threading\n    threading.Thread(target=lambda: __import__('time').sleep(1000)).start()",
    "import threading, time\n"
    "    for _ in range(200):\n        threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()",
    "import multiprocessing as m\n    m.Process(target=print).start()",
    "import subprocess; subprocess.Popen(['sleep', '1000'])",
    "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); signal.pause()",
    "import os; os.chdir('/'); open('/proc/self/x', 'w')",
    "import sys; sys.setrecursionlimit(10**9)\n    def f(): f()\n    f()",
    "x = bytearray(10**10)",
    "x = np.ones(10**10, np.uint8)",
    "x = []\n    while True: x.append(bytearray(10**6))",
    "global kept; kept = []\n    while True: kept.append(bytearray(10**5))",
    "return [0] * 10**7",
    "import gc; gc.disable(); import builtins; builtins.len = None",
    "import numpy; numpy.array = None",
    "import os; os.remove(__file__)",
    "import faulthandler; faulthandler._sigsegv()",
    "import resource; resource.setrlimit(resource.RLIMIT_CPU, (0, 0))\n    while True: pass",
    "import os; os.setsid()",
    "import signal; signal.raise_signal(signal.SIGSTOP)",
    "import os; os.write(3, b'x' * 100); os.write(4, b'x' * 100)",
    "import os\n    for fd in range(3, 20):\n        try: os.write(fd, b'ill' * 999)\n        except OSError: pass",
)
VALUES = (
    "None",
    "1",
    "'pose'",
    "(1, 2)",
    "(None, None)",
    "(None, None, 'ok')",
    "(1, 2, 3, 4)",
    "[]",
    "{}",
    "object()",
    "float('nan')",
    "(I, np.full(3, np.inf))",
    "(I * float('nan'), t)",
    "(I, t * 1e300)",
    "(I, t * 1e31)",
    "(-I, t)",
    "(I * 2, t)",
    "(I, t, 'ok ')",
    "(I, t, '')",
    "(I, t, None)",
    "(I, t, 5)",
    "(I, t, 'x' * 10**6)",
    "(I, t, '\\ud800')",
    "(I, t, 'a\\0b\\n\\x1b[2J')",
    "(I, 'abc')",
    "(I, [1, 2, [3]])",
    "(I, t.astype(object))",
    "(I.astype(complex), t)",
    "(I, t[:2])",
    "(I[:2], t)",
    "(I, t.reshape(3, 1))",
    "(I, t.reshape(1, 3))",
    "(I, 1e-320 * t)",
    "(x for x in 'ab')",
    "lambda: 1",
    "type('T', (), {'status': 'ok', 'R': I, 't': t})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'covariance': I})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'iterations': 10**30})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'iterations': -1})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'iterations': 2**40})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'iterations': float('nan')})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'covariance': np.full((6, 6), np.inf)})()",
    "type('T', (), {'status': 'ok', 'R': I, 't': t, 'covariance': -np.eye(6) * 1e300})()",
    "type('T', (), {'status': property(lambda self: 1 / 0), 'R': I, 't': t})()",
    "type('T', (), {'__getattr__': lambda self, name: self})()",
    "type('S', (str,), {'__eq__': lambda self, o: True, '__hash__': str.__hash__})('x')",
    "(I, t, type('S', (str,), {})('ok'))",
    "np.ma.masked_array((I, I), mask=True)",
    "(np.broadcast_to(np.float64(1), (3, 3)), t)",
    "(I, np.zeros(3))",
    "__import__('threading').Lock()",
)
IMPORTS = (
    "import sys; sys.exit(1)",
    "import os; os._exit(0)",
    "while True: pass",
    "raise KeyboardInterrupt",
    "import os; os.abort()",
    "1 / 0",
    "def (",
    "import nothing_of_this_name",
    "import os; os.fork()",
    "print('x' * 10**6)",
    "solve = 5",
    "def solve(): pass",
    "solve = print",
    "class solve: pass",
    "async def solve(a, b, c): pass",
    "def solve(*a): yield 1",
    "import os; os.closerange(3, 100)",
    "\0",
    "solve = solve",
    "from mine import solve",
    "def solve(a, b, c, d, e): pass",
    "import sys; sys.modules['numpy'] = None\ndef solve(a, b, c): return None",
)
PATIENCE = 3  # an import may take two minutes


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A function as a solver or an estimator, with two seconds for each image."""
    root = place.dataset(("estimates", "scores"))
    start = "import numpy as np\nI, t = np.eye(3), np.array([0.0, 0.0, 2000.0])\n"
    way = rng.choice(("body", "value", "value", "import"))
    if way == "import":
        code = rng.choice([text for text in IMPORTS if text != "while True: pass"])
        text = code
    else:
        code = rng.choice(BODIES) if way == "body" else f"return {rng.choice(VALUES)}"
        text = f"{start}def solve(a, b, c):\n    {code}\n"
    (place.folder / "mine.py").write_text(text, errors="surrogatepass")
    option = rng.choice(("--solver", "--estimator"))
    calls: list[Call] = [("estimate", root, "-q", option, "mine:solve", "--timeout", 2)]
    if rng.random() < 0.4:
        calls += [("score", root, "-q"), ("report", root)]
    return f"{option} {way} {code}"[:150], calls
