"""LLVM instructions, for one parameter set or for several lanes at once."""

import struct
from collections.abc import Sequence
from typing import NamedTuple

from clie_blocks.compiled.codegen.vector_math import vector_function
from clie_blocks.compiled.ir.foreign import foreign_name


class Value(NamedTuple):
    """A register: its name, whether it differs between lanes, whether it is a truth value."""

    name: str
    varying: bool
    boolean: bool = False


Operand = Value | float


class Builder:
    """Writes instructions for `width` lanes.

    What does not depend on a lane, such as time and held inputs, stays scalar and is computed
    once for all lanes.

    Parameters
    ----------
    width : int
        Number of lanes; 1 gives plain scalar code.

    """

    def __init__(self, width: int = 1) -> None:
        self.width, self._count = width, 0
        self.lines: list[str] = []
        self.declarations: set[str] = set()

    def put(self, text: str) -> str:
        """Write an instruction and return the register it defines."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {text}")
        return f"%v{self._count}"

    def arithmetic(self, instruction: str, a: Operand, b: Operand) -> Value:
        """Write a binary instruction such as fadd."""
        varying = _varying(a, b)
        return Value(self.put(f"{instruction} {self.type(varying)} {self._operand(a, varying)}, "
                              f"{self._operand(b, varying)}"), varying)

    def negate(self, a: Value) -> Value:
        """Write a change of sign."""
        return Value(self.put(f"fneg {self.type(a.varying)} {a.name}"), a.varying)

    def compare(self, predicate: str, a: Operand, b: Operand) -> Value:
        """Write a comparison such as olt."""
        varying = _varying(a, b)
        return Value(self.put(f"fcmp {predicate} {self.type(varying)} "
                              f"{self._operand(a, varying)}, {self._operand(b, varying)}"),
                     varying, boolean=True)

    def logic(self, instruction: str, a: Operand, b: Operand) -> Value:
        """Write ``and`` or ``or`` of two truth values."""
        varying = _varying(a, b)
        return Value(self.put(f"{instruction} {self.type(varying, 'i1')} "
                              f"{self._operand(a, varying)}, {self._operand(b, varying)}"),
                     varying, boolean=True)

    def invert(self, a: Value) -> Value:
        """Write the opposite of a truth value."""
        true = "true" if self._scalar(a.varying) else _vector(["i1 true"] * self.width)
        return Value(self.put(f"xor {self.type(a.varying, 'i1')} {a.name}, {true}"), a.varying,
                     boolean=True)

    def select(self, condition: Value, a: Operand, b: Operand) -> Value:
        """Write a choice between two numbers."""
        varying = _varying(condition, a, b)
        kind = self.type(varying)
        return Value(self.put(
            f"select {self.type(condition.varying, 'i1')} {condition.name}, "
            f"{kind} {self._operand(a, varying)}, {kind} {self._operand(b, varying)}"), varying)

    def intrinsic(self, name: str, *args: Operand) -> Value:
        """Write a call of ``llvm.name``, which processors have as an instruction."""
        varying = _varying(*args)
        suffix = "f64" if self._scalar(varying) else f"v{self.width}f64"
        return Value(self._call(f"llvm.{name}.{suffix}", self.type(varying),
                                [self._operand(a, varying) for a in args]), varying)

    def libm(self, name: str, *args: Operand) -> Value:
        """Write a call of the C library: for many lanes at once where it can, or lane by lane."""
        varying = _varying(*args)
        operands = [self._operand(a, varying) for a in args]
        if self._scalar(varying):
            return Value(self._call(name, "double", operands), varying)
        vectors = vector_function(name, self.width, len(args))
        result = (self._in_parts(*vectors, operands) if vectors
                  else self._by_lane(name, operands))
        return Value(result, varying)

    def sine(self, a: Operand) -> Value:
        """Write a sine."""
        return self.libm("sin", a)

    def cosine(self, a: Operand) -> Value:
        """Write a cosine."""
        return self.libm("cos", a)

    def _in_parts(self, symbol: str, length: int, operands: Sequence[str]) -> str:
        """Write calls of a function of vectors, each for a part of the lanes."""
        kind, whole = f"<{length} x double>", self.type(True)
        if length == self.width:
            return self._call(symbol, kind, operands)
        result = "poison"
        for first in range(0, self.width, length):
            lanes = range(first, first + length)
            pick = ", ".join(f"i32 {lane}" for lane in lanes)
            part = self._call(symbol, kind, [self.put(
                f"shufflevector {whole} {operand}, {whole} poison, <{length} x i32> <{pick}>")
                for operand in operands])
            spread = ", ".join(f"i32 {min(lane, length - 1)}" for lane in range(self.width))
            wide = self.put(f"shufflevector {kind} {part}, {kind} poison, "
                            f"<{self.width} x i32> <{spread}>")
            place = ", ".join(f"i32 {self.width + lane - first if lane in lanes else lane}"
                              for lane in range(self.width))
            result = self.put(f"shufflevector {whole} {result}, {whole} {wide}, "
                              f"<{self.width} x i32> <{place}>")
        return result

    def _by_lane(self, name: str, operands: Sequence[str]) -> str:
        result = "poison"
        for lane in range(self.width):
            picked = [self.put(f"extractelement {self.type(True)} {operand}, i32 {lane}")
                      for operand in operands]
            one = self._call(name, "double", picked)
            result = self.put(f"insertelement {self.type(True)} {result}, double {one}, "
                              f"i32 {lane}")
        return result

    def call_back(self, index: float, size: int, operands: Sequence[Operand]) -> list[Value]:
        """Write a call of a Python function and return its values; one lane."""
        self.declarations.add("declare void @opaque(i64, ptr, ptr)")
        given, results = self._memory(len(operands)), self._memory(size)
        for k, operand in enumerate(operands):
            self.store(operand, given, k, False)
        self.lines.append(f"  call void @opaque(i64 {int(index)}, ptr {given}, ptr {results})")
        return [self.load(results, k, False) for k in range(size)]

    def foreign(self, number: float, size: int, operands: Sequence[Operand]) -> list[Value]:
        """Write a call of a function from outside, lane by lane, and return its values."""
        name, varying = foreign_name(number), _varying(*operands)
        self.declarations.add(f"declare void @{name}(ptr, ptr)")
        given, results = self._memory(len(operands)), self._memory(size)
        if self._scalar(varying):
            for k, operand in enumerate(operands):
                self.store(operand, given, k, False)
            self.lines.append(f"  call void @{name}(ptr {given}, ptr {results})")
            return [self.load(results, k, False) for k in range(size)]
        lanes, values = [self._operand(a, varying) for a in operands], ["poison"] * size
        for lane in range(self.width):
            for k, lane_values in enumerate(lanes):
                one = self.put(f"extractelement {self.type(True)} {lane_values}, i32 {lane}")
                self.store(Value(one, False), given, k, False)
            self.lines.append(f"  call void @{name}(ptr {given}, ptr {results})")
            values = [self.put(f"insertelement {self.type(True)} {value}, double "
                               f"{self.load(results, k, False).name}, i32 {lane}")
                      for k, value in enumerate(values)]
        return [Value(value, True) for value in values]

    def _memory(self, size: int) -> str:
        """Write the reservation of memory for so many numbers, and return where it lies."""
        return self.put(f"alloca double, i64 {max(1, size)}")

    def load(self, pointer: str, offset: int, varying: bool) -> Value:
        """Write a load from so many floats behind a pointer."""
        return Value(self.put(f"load {self.type(varying)}, ptr "
                              f"{self._address(pointer, offset)}, align 8"), varying)

    def store(self, value: Operand, pointer: str, offset: int, varying: bool) -> None:
        """Write a store to so many floats behind a pointer."""
        text = self._operand(value, varying)
        self.lines.append(f"  store {self.type(varying)} {text}, ptr "
                          f"{self._address(pointer, offset)}, align 8")

    def type(self, varying: bool, scalar: str = "double") -> str:
        """Return the LLVM type of a value."""
        return scalar if self._scalar(varying) else f"<{self.width} x {scalar}>"

    def _scalar(self, varying: bool) -> bool:
        return self.width == 1 or not varying

    def _address(self, pointer: str, offset: int) -> str:
        return self.put(f"getelementptr double, ptr {pointer}, i64 {offset}")

    def _operand(self, value: Operand, varying: bool) -> str:
        if not isinstance(value, Value):
            text = constant(value)
            return text if self._scalar(varying) else _vector([f"double {text}"] * self.width)
        return value.name if value.varying == varying else self._splat(value)

    def _splat(self, value: Value) -> str:
        if self.width == 1:
            return value.name
        scalar = "i1" if value.boolean else "double"
        kind = self.type(True, scalar)
        one = self.put(f"insertelement {kind} poison, {scalar} {value.name}, i32 0")
        return self.put(f"shufflevector {kind} {one}, {kind} poison, "
                        f"<{self.width} x i32> zeroinitializer")

    def _call(self, name: str, kind: str, operands: Sequence[str]) -> str:
        self.declarations.add(
            f"declare {kind} @{name}({', '.join([kind] * len(operands))}) "
            "nounwind willreturn memory(none)")
        return self.put(f"call {kind} @{name}({', '.join(f'{kind} {a}' for a in operands)})")


def constant(value: float) -> str:
    """Return a float as LLVM text, exact in every bit."""
    return f"0x{struct.unpack('>Q', struct.pack('>d', float(value)))[0]:016X}"


def _varying(*values: Operand) -> bool:
    return any(isinstance(value, Value) and value.varying for value in values)


def _vector(entries: Sequence[str]) -> str:
    return f"<{', '.join(entries)}>"
