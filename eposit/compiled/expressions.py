"""Expressions of a kernel as lines of LLVM's assembly language; `translate` says which there are."""

from __future__ import annotations

import ast
import math

from eposit.compiled.kernel import LANES, NUMBER, NUMBERS, POINTER, TRUTH, TRUTHS, WHOLE, Kernel
from eposit.compiled.operands import Operands, Value, Values, common, literal, llvm_type

# Functions of numbers: name in the assembly language, number of arguments. The C library has those without `llvm`.
FUNCTIONS = {
    "sqrt": ("llvm.sqrt.f64", 1), "abs": ("llvm.fabs.f64", 1), "copysign": ("llvm.copysign.f64", 2),
    "sin": ("sin", 1), "cos": ("cos", 1), "tan": ("tan", 1), "acos": ("acos", 1), "atan": ("atan", 1),
    "atan2": ("atan2", 2), "log": ("log", 1), "pow": ("pow", 2),
}  # fmt: skip
FUNCTIONS_OF_FOUR = {"sqrt": "llvm.sqrt.v4f64", "abs": "llvm.fabs.v4f64"}
LIBRARY = tuple(name for name, _ in FUNCTIONS.values() if "." not in name)
OPERATIONS = {
    ast.Add: ("add", "fadd"), ast.Sub: ("sub", "fsub"), ast.Mult: ("mul", "fmul"), ast.FloorDiv: ("sdiv", ""),
    ast.Mod: ("srem", ""), ast.Div: ("", "fdiv"),
}  # fmt: skip
COMPARISONS = {
    ast.Lt: ("slt", "olt"), ast.LtE: ("sle", "ole"), ast.Gt: ("sgt", "ogt"), ast.GtE: ("sge", "oge"),
    ast.Eq: ("eq", "oeq"), ast.NotEq: ("ne", "une"),
}  # fmt: skip


class Expressions(Operands):
    """Values of expressions, with the lines that compute them."""

    def value(self, node: ast.expr) -> Value:
        """A single value."""
        found = self.visit(node)
        return found if isinstance(found, Value) else self.refuse(node, "has several values where one is wanted")

    def visit_Constant(self, node: ast.Constant) -> Value:
        """A constant."""
        return literal(node.value)

    def visit_Name(self, node: ast.Name) -> Value:
        """A variable, or a constant of the module."""
        if node.id not in self.variables:
            return literal(self.globals[node.id])
        kind, place = self.variables[node.id]
        return self.assigned(kind, f"load {kind}, ptr {place}")

    def visit_Attribute(self, node: ast.Attribute) -> Value:
        """A constant of `math`."""
        return literal(getattr(math, node.attr))

    def visit_Tuple(self, node: ast.Tuple) -> tuple[Value, ...]:
        """Several values."""
        return tuple(self.value(part) for part in node.elts)

    def visit_Subscript(self, node: ast.Subscript) -> Value:
        """A number of an array or of four, or one of the values that a function returns."""
        if isinstance(node.value, ast.Call):
            assert isinstance(node.slice, ast.Constant)
            return self.visit(node.value)[node.slice.value]
        array = self.value(node.value)
        if array.kind == NUMBERS:
            return self.lane(array, self.as_kind(self.value(node.slice), WHOLE, node))
        return self.assigned(NUMBER, f"load double, ptr {self.place(node, array)}")

    def place(self, node: ast.Subscript, array: Value) -> str:
        """The address of a number of an array."""
        index = self.value(node.slice)
        base, index = self.as_kind(array, POINTER, node), self.as_kind(index, WHOLE, node)
        return self.assigned(POINTER, f"getelementptr double, ptr {base}, i64 {index}").text

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Value:
        """Of a number its negative, of a truth value its contrary."""
        value = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return self.assigned(TRUTH, f"xor i1 {self.as_kind(value, TRUTH, node)}, true")
        if not isinstance(node.op, ast.USub):
            self.generic_visit(node)
        if value.kind in (NUMBER, NUMBERS):
            return self.assigned(value.kind, f"fneg {value.kind} {value.text}")
        return self.assigned(WHOLE, f"sub i64 0, {self.as_kind(value, WHOLE, node)}")

    def visit_BinOp(self, node: ast.BinOp) -> Value:
        """Arithmetic."""
        if isinstance(node.op, ast.Pow):
            return self._power(node)
        return self.operation(node.op, self.value(node.left), self.value(node.right), node)

    def operation(self, operator: ast.operator, left: Value, right: Value, node: ast.AST) -> Value:
        """Of two values; quotients and remainders of whole numbers must not be negative."""
        if type(operator) not in OPERATIONS:
            self.generic_visit(node)
        for_whole, for_numbers = OPERATIONS[type(operator)]
        kind = common(left, right, whole=bool(for_whole))
        name = for_whole if kind == WHOLE else for_numbers
        if not name:
            self.refuse(node, "has an operation that its numbers do not have")
        a, b = self.as_kind(left, kind, node), self.as_kind(right, kind, node)
        return self.assigned(kind, f"{name} {kind} {a}, {b}")

    def _power(self, node: ast.BinOp) -> Value:
        """A square as a product, else by the C library."""
        base = self.value(node.left)
        if isinstance(node.right, ast.Constant) and node.right.value == 2:
            return self.operation(ast.Mult(), base, base, node)
        return self._call_number("pow", [base, self.value(node.right)], node)

    def visit_Compare(self, node: ast.Compare) -> Value:
        """One or several comparisons, and `in` of a tuple."""
        left, result = self.value(node.left), Value(TRUTH, "true")
        for operator, other in zip(node.ops, node.comparators, strict=True):
            if isinstance(operator, ast.In):
                assert isinstance(other, ast.Tuple)
                one = Value(TRUTH, "false")
                for part in other.elts:
                    equal = self._compared(ast.Eq(), left, self.value(part), node)
                    one = self.assigned(TRUTH, f"or i1 {one.text}, {equal.text}")
                right = left
            else:
                right = self.value(other)
                one = self._compared(operator, left, right, node)
            result = self.assigned(TRUTH, f"and i1 {result.text}, {one.text}") if result.text != "true" else one
            left = right
        return result

    def _compared(self, operator: ast.cmpop, left: Value, right: Value, node: ast.AST) -> Value:
        signed, ordered = COMPARISONS[type(operator)]
        kind = common(left, right)
        if kind == WHOLE:
            return self.assigned(TRUTH, f"icmp {signed} i64 {left.text}, {right.text}")
        a, b = self.as_kind(left, kind, node), self.as_kind(right, kind, node)
        return self.assigned(TRUTHS if kind == NUMBERS else TRUTH, f"fcmp {ordered} {kind} {a}, {b}")

    def visit_BoolOp(self, node: ast.BoolOp) -> Value:
        """`and` and `or`: what follows is left out where the first values decide."""
        place, end = self.slot(TRUTH), self.fresh()
        for i, part in enumerate(node.values):
            value = self.as_kind(self.value(part), TRUTH, node)
            self.line(f"store i1 {value}, ptr {place}")
            if i < len(node.values) - 1:
                go_on = self.fresh()
                yes, no = (go_on, end) if isinstance(node.op, ast.And) else (end, go_on)
                self.line(f"br i1 {value}, label %{yes}, label %{no}")
                self.line(f"{go_on}:")
        self.label(end)
        return self.assigned(TRUTH, f"load i1, ptr {place}")

    def visit_IfExp(self, node: ast.IfExp) -> Value:
        """One of two values of the same type; the other is not computed. In each of four lanes its own one of both."""
        truth = self.value(node.test)
        if truth.kind == TRUTHS:
            return self.chosen(truth, self.value(node.body), self.value(node.orelse), node)
        yes, no, end = self.fresh(), self.fresh(), self.fresh()
        test = self.as_kind(truth, TRUTH, node)
        self.line(f"br i1 {test}, label %{yes}, label %{no}")
        self.line(f"{yes}:")
        value = self.value(node.body)
        place = self.slot(value.kind)
        self.line(f"store {value.kind} {value.text}, ptr {place}")
        self.line(f"br label %{end}")
        self.line(f"{no}:")
        other = self.as_kind(self.value(node.orelse), value.kind, node)
        self.line(f"store {value.kind} {other}, ptr {place}")
        self.label(end)
        return self.assigned(value.kind, f"load {value.kind}, ptr {place}")

    def visit_Call(self, node: ast.Call) -> Values:
        """A kernel, a function of `math`, or one of Python's few."""
        if isinstance(node.func, ast.Name) and isinstance(self.globals.get(node.func.id), Kernel):
            return self._call_kernel(node, self.globals[node.func.id])
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
        values = [self.value(argument) for argument in node.args]
        if name == "int":
            return self.assigned(WHOLE, f"fptosi double {self.as_kind(values[0], NUMBER, node)} to i64")
        if name == "four":
            return self.lanes([self.as_kind(value, NUMBER, node) for value in values])
        if name in ("min", "max"):
            return self._extreme(name, values, node)
        if name not in FUNCTIONS:
            self.refuse(node, "calls what no kernel can call; see eposit.compiled.translate")
        return self._call_number(name, values, node)

    def _call_number(self, name: str, values: list[Value], node: ast.AST) -> Value:
        if values[0].kind == NUMBERS and name in FUNCTIONS_OF_FOUR:
            return self.assigned(NUMBERS, f"call {NUMBERS} @{FUNCTIONS_OF_FOUR[name]}({NUMBERS} {values[0].text})")
        operands, called = [self.as_kind(value, NUMBER, node) for value in values], FUNCTIONS[name][0]
        built_in = "nobuiltin" if called in LIBRARY else ""  # LLVM knows its name, and would exchange it for another
        given = ", ".join(f"double {operand}" for operand in operands)
        return self.assigned(NUMBER, f"call double @{called}({given}) {built_in}")

    def _extreme(self, name: str, values: list[Value], node: ast.AST) -> Value:
        """As Python: the first of two, unless the second is beyond it."""
        first, second = values
        beyond = self._compared(ast.Lt() if name == "min" else ast.Gt(), second, first, node)
        return self.chosen(beyond, second, first, node)

    def _call_kernel(self, node: ast.Call, kernel: Kernel) -> Values:
        """Once, or once for each lane where four numbers are given for one."""
        self.called.append(kernel)
        if len(node.args) != len(kernel.arguments):
            self.refuse(node, f"has {len(node.args)} arguments; the kernel takes {len(kernel.arguments)}")
        values = [self.value(one) for one in node.args]
        wide = [value.kind == NUMBERS != kind for value, kind in zip(values, kernel.arguments, strict=True)]
        if not any(wide):
            return self._call_once(values, kernel, node)
        found: list[tuple[Value, ...]] = []
        for i in range(LANES):
            own = [self.lane(value, str(i)) if split else value for value, split in zip(values, wide, strict=True)]
            one = self._call_once(own, kernel, node)
            found.append((one,) if isinstance(one, Value) else one)
        same_place = zip(*found, strict=True)
        whole = tuple(self.lanes([self.as_kind(one, NUMBER, node) for one in same]) for same in same_place)
        return whole[0] if len(whole) == 1 else whole

    def _call_once(self, values: list[Value], kernel: Kernel, node: ast.AST) -> Values:
        kinds = zip(values, kernel.arguments, strict=True)
        given = ", ".join(f"{kind} {self.as_kind(value, kind, node)}" for value, kind in kinds)
        call = f'call {llvm_type(kernel.returns)} @"{kernel.name}"({given})'
        if isinstance(kernel.returns, str):
            if kernel.returns != "void":
                return self.assigned(kernel.returns, call)
            self.line(call)
            return ()
        whole = self.assigned("struct", call).text
        kind = llvm_type(kernel.returns)
        return tuple(self.assigned(one, f"extractvalue {kind} {whole}, {i}") for i, one in enumerate(kernel.returns))
