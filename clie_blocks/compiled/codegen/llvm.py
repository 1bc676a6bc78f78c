"""Expressions as LLVM instructions."""

from collections.abc import Callable, Iterable

from clie_blocks.compiled.codegen.builder import Builder, Operand, Value
from clie_blocks.compiled.codegen.lane_layout import SINGLE, Memory
from clie_blocks.compiled.codegen.sine_cosine import LaneBuilder
from clie_blocks.compiled.ir.operations import operation_named
from clie_blocks.compiled.ir.symbols import Expression, Symbol, topological


def emit(builder: Builder, roots: Iterable[Expression],
         variables: Callable[[str, int], Value]) -> list[Operand]:
    """Write the instructions of some expressions."""
    values = {}
    for node in topological(roots):
        if node.op == "variable":
            values[node] = variables(*node.args)
        else:
            operands = [values[a] if isinstance(a, Symbol) else a for a in node.args]
            values[node] = operation_named(node.op).llvm(builder, *operands)
    return [values[root] if isinstance(root, Symbol) else root for root in roots]


def loader(builder: Builder, memory: Memory) -> Callable[[str, int], Value]:
    """Return ``variable(kind, index)``, which loads each variable of a program once."""
    loaded = {}

    def variable(kind: str, index: int) -> Value:
        if kind == "t":
            return Value("%t", False)
        if (kind, index) not in loaded:
            loaded[kind, index] = builder.load(
                f"%{kind}", memory.offset(kind, index), memory.varies(kind, index))
        return loaded[kind, index]

    return variable


def function(name: str, roots: Iterable[Expression], result: str, attributes: str = "",
             memory: Memory = SINGLE, constants_from: int | None = None) -> tuple[str, set[str]]:
    """Return the text and the declarations of ``name(t, x, u, p, result)``.

    Constants of the run begin so many numbers behind `p`.
    """
    builder = LaneBuilder(memory.width)
    if constants_from is not None:
        builder.lines.append(f"  %c = getelementptr double, ptr %p, i64 {constants_from}")
    for k, value in enumerate(emit(builder, roots, loader(builder, memory))):
        builder.store(value, "%result", memory.offset(result, k), memory.varies(result, k))
    body = "\n".join(builder.lines)
    text = (f"define void @{name}(double %t, ptr noalias %x, ptr noalias %u, ptr noalias %p, "
            f"ptr noalias %result) {attributes} {{\n{body}\n  ret void\n}}\n")
    return text, builder.declarations
