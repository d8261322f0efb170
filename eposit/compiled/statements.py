"""Statements of a kernel as lines of LLVM's assembly language; `translate` says which there are."""

from __future__ import annotations

import ast

from eposit.compiled.expressions import Expressions
from eposit.compiled.kernel import NOTHING, WHOLE, Kernel
from eposit.compiled.operands import Value, Values, llvm_type


class Body(Expressions):
    """The lines of one function."""

    def __init__(self, kernel: Kernel, parameters: list[str]):
        super().__init__(kernel)
        self._loops: list[tuple[str, str]] = []  # labels to which `continue` and `break` lead
        for i, (name, kind) in enumerate(zip(parameters, kernel.arguments, strict=True)):
            self._store(name, Value(kind, f"%a{i}"), ast.Name(name))

    def block(self, statements: list[ast.stmt]) -> None:
        """One statement after the other."""
        for statement in statements:
            self.visit(statement)

    def visit_Expr(self, node: ast.Expr) -> None:
        """A call for its effects, or a docstring."""
        if not isinstance(node.value, ast.Constant):
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        """One value for each target; all are computed before the first is stored."""
        values = self.visit(node.value)
        for target in node.targets:
            self._assign(target, values)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        """A target changed by an operation."""
        if isinstance(node.target, ast.Subscript):
            place = self.place(node.target, self.value(node.target.value))
            before = self.assigned("double", f"load double, ptr {place}")
            after = self.operation(node.op, before, self.value(node.value), node)
            self.line(f"store double {after.text}, ptr {place}")
        else:
            assert isinstance(node.target, ast.Name)
            before = self.visit_Name(node.target)
            self._store(node.target.id, self.operation(node.op, before, self.value(node.value), node), node)

    def _assign(self, target: ast.expr, values: Values) -> None:
        if isinstance(target, ast.Tuple):
            assert not isinstance(values, Value)
            for one, value in zip(target.elts, values, strict=True):
                self._assign(one, value)
            return
        if not isinstance(values, Value):
            self.refuse(target, "is one target for several values")
        elif isinstance(target, ast.Subscript):
            number = self.as_kind(values, "double", target)
            self.line(f"store double {number}, ptr {self.place(target, self.value(target.value))}")
        elif isinstance(target, ast.Name):
            self._store(target.id, values, target)
        else:
            self.generic_visit(target)

    def _store(self, name: str, value: Value, node: ast.AST) -> None:
        """Give a variable a value: the first one settles its type."""
        if name not in self.variables:
            self.variables[name] = Value(value.kind, self.slot(value.kind))
        kind, place = self.variables[name]
        self.line(f"store {kind} {self.as_kind(value, kind, node)}, ptr {place}")

    def visit_If(self, node: ast.If) -> None:
        """One of two blocks."""
        yes, no, end = self.fresh(), self.fresh(), self.fresh()
        test = self.as_kind(self.value(node.test), "i1", node.test)
        self.line(f"br i1 {test}, label %{yes}, label %{no}")
        self.line(f"{yes}:")
        self.block(node.body)
        self.line(f"br label %{end}")
        self.line(f"{no}:")
        self.block(node.orelse)
        self.label(end)

    def visit_While(self, node: ast.While) -> None:
        """A loop while a test holds."""
        if node.orelse:
            self.generic_visit(node)
        again, inside, end = self.fresh(), self.fresh(), self.fresh()
        self.label(again)
        test = self.as_kind(self.value(node.test), "i1", node.test)
        self.line(f"br i1 {test}, label %{inside}, label %{end}")
        self.line(f"{inside}:")
        self._loop(node.body, again, end)
        self.line(f"br label %{again}")
        self.line(f"{end}:")

    def visit_For(self, node: ast.For) -> None:
        """A loop over a range, whose step is a constant."""
        call = node.iter
        if node.orelse or not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            self.generic_visit(node)
        assert isinstance(call, ast.Call)
        assert isinstance(node.target, ast.Name)
        given = [self.value(argument) for argument in call.args]
        first = given[0] if len(given) > 1 else Value(WHOLE, "0")
        stop = self.as_kind(given[min(1, len(given) - 1)], WHOLE, node.target)
        step = ast.literal_eval(call.args[2]) if len(given) == 3 else 1
        counter, again, inside = self.slot(WHOLE), self.fresh(), self.fresh()
        following, end = self.fresh(), self.fresh()
        self.line(f"store i64 {self.as_kind(first, WHOLE, node.target)}, ptr {counter}")
        self.label(again)
        now = self.assigned(WHOLE, f"load i64, ptr {counter}")
        test = self.assigned("i1", f"icmp {'slt' if step > 0 else 'sgt'} i64 {now.text}, {stop}")
        self.line(f"br i1 {test.text}, label %{inside}, label %{end}")
        self.line(f"{inside}:")
        self._store(node.target.id, now, node.target)
        self._loop(node.body, following, end)
        self.label(following)
        after = self.assigned(WHOLE, f"add i64 {now.text}, {step}")
        self.line(f"store i64 {after.text}, ptr {counter}")
        self.line(f"br label %{again}")
        self.line(f"{end}:")

    def _loop(self, statements: list[ast.stmt], following: str, end: str) -> None:
        self._loops.append((following, end))
        self.block(statements)
        self._loops.pop()

    def visit_Break(self, node: ast.Break) -> None:
        """Leave the loop."""
        self._leave(f"br label %{self._loops[-1][1]}")

    def visit_Continue(self, node: ast.Continue) -> None:
        """Go on with the loop."""
        self._leave(f"br label %{self._loops[-1][0]}")

    def visit_Return(self, node: ast.Return) -> None:
        """Leave the function, with a value or with several."""
        returns = self.kernel.returns
        if node.value is None:
            self._leave("ret void")
        elif isinstance(returns, str):
            if returns == NOTHING:
                self.refuse(node, "returns a value from a function that has none")
            self._leave(f"ret {returns} {self.as_kind(self.value(node.value), returns, node)}")
        else:
            values, whole, kind = self.visit(node.value), "poison", llvm_type(returns)
            for i, (value, one) in enumerate(zip(values, returns, strict=True)):
                operand = self.as_kind(value, one, node)
                whole = self.assigned(kind, f"insertvalue {kind} {whole}, {one} {operand}, {i}").text
            self._leave(f"ret {kind} {whole}")

    def _leave(self, text: str) -> None:
        """End a block; lines that follow it are never reached."""
        self.line(text)
        self.line(f"{self.fresh()}:")
