"""The program as one self-contained C99 file, for a target or a Simulink S-function."""

import math
import re
from collections.abc import Sequence

from clie_blocks.compiled.codegen.methods import Method
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import operation_named
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.ir.symbols import Expression, Symbol, topological

_FILE = """\
/* {title}
 *
 * Made from a python-control diagram; C99, needs math.h alone, allocates nothing.
 *
 *   {name}_init(x, p)             initial state zero, parameters as in the diagram
 *   {name}_step(t, h, x, u, p)    {step_text}
 *   {name}_output(t, x, u, p, y)  outputs at this instant
 *
{legend}
 */
#include <math.h>

#define {upper}_NX {nx}
#define {upper}_NU {nu}
#define {upper}_NY {ny}

typedef struct {{
{fields}
}} {name}_params;

void {name}_init(double *x, {name}_params *p)
{{
    for (int i = 0; i < {nx}; i++) x[i] = 0.0;
{defaults}
}}

static void {name}_derivative(double t, const double *x, const double *u,
                              const {name}_params *p, double *dx)
{{
    (void)t; (void)x; (void)u; (void)p; (void)dx;
{derivative}
}}

void {name}_output(double t, const double *x, const double *u, const {name}_params *p, double *y)
{{
    (void)t; (void)x; (void)u; (void)p; (void)y;
{output}
}}

void {name}_step(double t, double h, double *x, const double *u, const {name}_params *p)
{{
{step}
}}
"""


def source(name: str, layout: Layout, outputs: list[Expression], parameters: Parameters,
           method: Method, legend: list[str]) -> str:
    """Return the C text of a program."""
    prefix = _identifier(name)
    fields = _fields(parameters)
    step_text = ("next sample" if method.is_map
                 else f"one {method.title} step ({method.name}) of h seconds, u held")
    return _FILE.format(
        title=f"Diagram {name}", name=prefix, upper=prefix.upper(), step_text=step_text,
        legend="\n".join(f" *   {line}" for line in legend), nx=layout.nx, nu=layout.nu,
        ny=len(outputs), fields=_declarations(parameters) or "    char none;",
        defaults="\n".join(f"    {field} = {_number(value)};"
                           for field, value in zip(fields, parameters.defaults)) or "    (void)p;",
        derivative=_assignments(layout.derivatives, "dx", fields),
        output=_assignments(outputs, "y", fields), step=_step(prefix, layout.nx, method))


def _identifier(text: str) -> str:
    clean = re.sub(r"\W", "_", text)
    return f"_{clean}" if clean[:1].isdigit() else clean


def _fields(parameters: Parameters) -> list[str]:
    """C expression of every parameter slot, in the order of the slots."""
    fields = [""] * parameters.defaults.size
    for key, start in parameters.offset.items():
        shape = parameters.shape[key]
        for k in range(math.prod(shape)):
            fields[start + k] = f"p->{_identifier(key)}" + (f"[{k}]" if shape else "")
    return fields


def _declarations(parameters: Parameters) -> str:
    return "\n".join(
        f"    double {_identifier(key)}" + (f"[{math.prod(shape)}]" if shape else "") + ";"
        for key, shape in parameters.shape.items())


def _assignments(roots: Sequence[Expression], target: str, fields: list[str]) -> str:
    lines: list[str] = []
    text: dict[Symbol, str] = {}

    def operand(a: Expression) -> str:
        return text[a] if isinstance(a, Symbol) else _number(a)

    for node in topological(roots):
        if node.op == "variable":
            kind, index = node.args
            text[node] = {"t": "t", "p": fields[index] if kind == "p" else ""}.get(
                kind, f"{kind}[{index}]")
            continue
        row = operation_named(node.op)
        text[node] = f"v{len(lines)}"
        kind = "int" if row.boolean else "double"
        lines.append(f"    const {kind} {text[node]} = "
                     f"{row.c.format(*map(operand, node.args))};")
    return "\n".join([*lines, *(f"    {target}[{k}] = {operand(root)};"
                                for k, root in enumerate(roots))])


def _number(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    return repr(float(value)) if math.copysign(1, value) > 0 else f"({float(value)!r})"


def _step(prefix: str, nx: int, method: Method) -> str:
    if nx == 0:
        return f"    (void)h;\n    {prefix}_derivative(t, x, u, p, x);"
    lines = [f"    double k[{len(method.b)}][{nx}], y[{nx}];"]
    for i, (weights, c) in enumerate(zip(method.a, method.c)):
        if any(weights):
            lines.append(_combine("y", weights, nx))
        at = "y" if any(weights) else "x"
        time = f"t + {c!r} * h" if c else "t"
        lines.append(f"    {prefix}_derivative({time}, {at}, u, p, k[{i}]);")
    if method.is_map:
        lines += [f"    for (int i = 0; i < {nx}; i++) x[i] = k[0][i];",
                  "    (void)h; (void)y;"]
    else:
        lines.append(_combine("x", method.b, nx))
        if not any(any(weights) for weights in method.a):
            lines.append("    (void)y;")
    return "\n".join(lines)


def _combine(target: str, weights: Sequence[float], nx: int) -> str:
    total = " + ".join(f"{weight!r} * k[{j}][i]" for j, weight in enumerate(weights) if weight)
    return f"    for (int i = 0; i < {nx}; i++) {target}[i] = x[i] + h * ({total});"
