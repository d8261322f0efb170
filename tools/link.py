"""Make the checkout's four packages importable from any working directory in this environment.

A path file instead of an editable install: it needs no build, and it comes before other packages of the same names.
"""

import site
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINE = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"

for directory in site.getsitepackages():
    (Path(directory) / "eposit_lab.pth").write_text(LINE, encoding="utf-8")
