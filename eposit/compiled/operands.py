"""Operands of a kernel's expressions: values with their types, and the lines of LLVM's assembly language so far."""

from __future__ import annotations

import ast
import struct
from typing import Any, NamedTuple

from eposit.compiled.kernel import LANES, NUMBER, NUMBERS, TRUTH, TRUTHS, WHOLE, Kernel, Returns


class Value(NamedTuple):
    """An operand and its type."""

    kind: str
    text: str


Values = Value | tuple[Value, ...]


def llvm_type(returns: Returns) -> str:
    """The type of what a function returns."""
    return returns if isinstance(returns, str) else "{" + ", ".join(returns) + "}"


def literal(value: Any) -> Value:
    """A constant: truth value, whole number or number."""
    if isinstance(value, bool):
        return Value(TRUTH, str(value).lower())
    if isinstance(value, int):
        return Value(WHOLE, str(value))
    if isinstance(value, float):
        return Value(NUMBER, "0x" + struct.pack(">d", value).hex())
    raise TypeError(f"a kernel has numbers and truth values as constants, not {value!r}")


class Operands(ast.NodeVisitor):
    """The lines of a function so far, its variables, and what makes one operand of another."""

    def __init__(self, kernel: Kernel):
        self.kernel, self.globals = kernel, kernel.function.__globals__
        self.variables: dict[str, Value] = {}  # type and place of each
        self.slots: list[str] = []  # lines that make places for variables
        self.lines: list[str] = []
        self.called: list[Kernel] = []
        self._count = 0

    def line(self, text: str) -> None:
        """Add one line."""
        self.lines.append(text)

    def fresh(self) -> str:
        """A new name."""
        self._count += 1
        return f"v{self._count}"

    def assigned(self, kind: str, text: str) -> Value:
        """The value of one operation."""
        name = "%" + self.fresh()
        self.line(f"{name} = {text}")
        return Value(kind, name)

    def slot(self, kind: str) -> str:
        """A place for a value of this type."""
        name = "%" + self.fresh()
        self.slots.append(f"{name} = alloca {kind}")
        return name

    def label(self, name: str) -> None:
        """Begin a new block of lines, into which the last one leads."""
        self.line(f"br label %{name}")
        self.line(f"{name}:")

    def as_kind(self, value: Value, kind: str, node: ast.AST) -> str:
        """The operand of a value as another type: whole numbers become numbers."""
        if value.kind == kind:
            return value.text
        if (value.kind, kind) == (WHOLE, NUMBER):
            if value.text.lstrip("-").isdigit():
                return literal(float(value.text)).text
            return self.assigned(NUMBER, f"sitofp i64 {value.text} to double").text
        if kind == NUMBERS and value.kind in (NUMBER, WHOLE):
            return self.lanes([self.as_kind(value, NUMBER, node)] * LANES).text
        return self.refuse(node, f"is of type {value.kind} where {kind} is wanted")

    def lanes(self, operands: list[str]) -> Value:
        """Four numbers side by side."""
        whole = "poison"
        for i, operand in enumerate(operands):
            whole = self.assigned(NUMBERS, f"insertelement {NUMBERS} {whole}, double {operand}, i64 {i}").text
        return Value(NUMBERS, whole)

    def lane(self, value: Value, i: str) -> Value:
        """One of four numbers."""
        return self.assigned(NUMBER, f"extractelement {NUMBERS} {value.text}, i64 {i}")

    def refuse(self, node: ast.AST, why: str) -> Any:
        """Stop with the place in the source."""
        code = self.kernel.function.__code__
        raise TypeError(f"{code.co_filename}:{getattr(node, 'lineno', 0)}: {ast.unparse(node)!r} {why}")

    def generic_visit(self, node: ast.AST) -> Any:
        """Refuse what kernels do not have."""
        self.refuse(node, "is nothing that a kernel can have; see eposit.compiled.translate")

    def chosen(self, test: Value, yes: Value, no: Value, node: ast.AST) -> Value:
        """One of two values that are both computed."""
        kind = NUMBERS if test.kind == TRUTHS else common(yes, no)
        a, b = self.as_kind(yes, kind, node), self.as_kind(no, kind, node)
        return self.assigned(kind, f"select {test.kind} {test.text}, {kind} {a}, {kind} {b}")


def common(a: Value, b: Value, whole: bool = True) -> str:
    """The type of two values together. whole: whether two whole numbers stay whole."""
    if NUMBERS in (a.kind, b.kind):
        return NUMBERS
    return WHOLE if whole and a.kind == b.kind == WHOLE else NUMBER
