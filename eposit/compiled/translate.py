"""From Python to LLVM's assembly language: the few statements that numerical loops need.

A function has whole numbers (64 bits), numbers (double precision), truth values and pointers to numbers; its variables
keep the type of their first value, and a whole number becomes a number where one is wanted, never the reverse. There
are assignments, also of several values, `if`, `while`, `for ... in range(...)`, `break`, `continue`, `return`;
arithmetic, comparisons, `and`, `or`, `not`, `a if b else c`, one index in brackets; `abs`, `min` and `max` of two,
`int`, functions of `math`, and other kernels. `four` puts four numbers side by side, and what is done with them is done
in each of these lanes; a comparison of such decides in `a if b else c` for each lane on its own, and a kernel of single
numbers is called once for each lane. Anything else is refused. A division by zero gives infinity or NaN, as in
NumPy; a quotient or remainder of whole numbers is right where neither is negative.

Sums and products stay in the order in which they are written: results do not depend on what LLVM could rearrange.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from eposit.compiled.expressions import FUNCTIONS, FUNCTIONS_OF_FOUR
from eposit.compiled.kernel import NOTHING, NUMBERS, Kernel
from eposit.compiled.operands import llvm_type
from eposit.compiled.statements import Body


def module_text(kernel: Kernel) -> str:
    """A kernel and all that it calls; the kernel alone can be called from outside."""
    lines = [f"declare double @{name}({', '.join(['double'] * count)})" for name, count in FUNCTIONS.values()]
    lines += [f"declare {NUMBERS} @{name}({NUMBERS})" for name in FUNCTIONS_OF_FOUR.values()]
    done: set[str] = set()
    wanted = [kernel]
    while wanted:
        one = wanted.pop()
        if one.name not in done:
            done.add(one.name)
            text, called = function_text(one, is_root=one is kernel)
            lines.append(text)
            wanted += called
    return "\n".join(lines)


def function_text(kernel: Kernel, is_root: bool) -> tuple[str, list[Kernel]]:
    """One function, and the kernels that it calls."""
    node = _syntax(kernel)
    body = Body(kernel, [argument.arg for argument in node.args.args])
    body.block(node.body)
    if kernel.returns == NOTHING:
        body.line("ret void")
    else:
        body.line("unreachable")
    arguments = ", ".join(f"{kind} %a{i}" for i, kind in enumerate(kernel.arguments))
    inlining = "alwaysinline" if kernel.inline else "noinline"
    scope = "" if is_root else "internal "
    head = f'define {scope}{llvm_type(kernel.returns)} @"{kernel.name}"({arguments}) {inlining} nounwind {{'
    return "\n".join((head, "entry:", *body.slots, *body.lines, "}")), body.called


def _syntax(kernel: Kernel) -> ast.FunctionDef:
    code = kernel.function.__code__
    for node in _module_syntax(code.co_filename).body:
        if isinstance(node, ast.FunctionDef) and node.name == code.co_name:
            return node
    raise TypeError(f"{kernel.name} is not a function of its module; kernels must be")


@cache
def _module_syntax(path: str) -> ast.Module:
    return ast.parse(Path(path).read_text(encoding="utf-8"), path)
