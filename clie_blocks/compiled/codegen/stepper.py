"""The fixed-step loop as LLVM text: the same for every diagram, in memory form.

The states and the derivatives of the stages stay in memory and the right-hand side is a call, so
compile time grows linearly with the diagram; the loops over the states are short, of constant
length, and become vector instructions.
"""

from collections.abc import Sequence

from clie_blocks.compiled.codegen.builder import constant
from clie_blocks.compiled.codegen.methods import Method

WIDE = 8  # lanes that fill a register of 512 bits, which the compiler would halve in loops

SIGNATURE = """\
define i64 @run(i64 %n, double %h, double %t0, i64 %first, ptr noalias %x, ptr noalias %inputs,
                ptr noalias %{given}, i64 %every, i64 %nlog, ptr noalias %slots,
                ptr noalias %log)"""

STEP = """\
  %any = icmp sgt i64 %n, 0
  br i1 %any, label %step, label %done
step:
  %s = phi i64 [ 0, %entry ], [ %s.next, %advance ]
  %row = phi ptr [ %log, %entry ], [ %row.next, %advance ]
  %count = add i64 %first, %s
  %count.real = sitofp i64 %count to double
  %elapsed = fmul double %count.real, %h
  %t = fadd double %t0, %elapsed
  %u.offset = mul i64 %s, {nu}
  %u = getelementptr double, ptr %inputs, i64 %u.offset
"""

_LOOP = SIGNATURE + """
                {attributes} {{
entry:
{arrays}
""" + STEP + """\
  %phase = urem i64 %count, %every
  %on.time = icmp eq i64 %phase, 0
  %wanted = icmp sgt i64 %nlog, 0
  %due = and i1 %on.time, %wanted
  br i1 %due, label %observe, label %stages
observe:
  call void @observe(double %t, ptr %x, ptr %u, ptr %p, ptr %record)
  br label %gather
gather:
  %g = phi i64 [ 0, %observe ], [ %g.next, %gather ]
  %slot.at = getelementptr i64, ptr %slots, i64 %g
  %slot = load i64, ptr %slot.at
  %from = getelementptr double, ptr %record, i64 %slot
  %picked = load double, ptr %from
  %to = getelementptr double, ptr %row, i64 %g
  store double %picked, ptr %to
  %g.next = add i64 %g, 1
  %g.more = icmp slt i64 %g.next, %nlog
  br i1 %g.more, label %gather, label %logged
logged:
  %row.after = getelementptr double, ptr %row, i64 %nlog
  br label %stages
stages:
  %row.next = phi ptr [ %row, %step ], [ %row.after, %logged ]
{stages}
advance:
  %s.next = add i64 %s, 1
  %more = icmp slt i64 %s.next, %n
  br i1 %more, label %step, label %done
done:
  %taken = phi i64 [ 0, %entry ], [ %s.next, %advance ]{stopped}
  ret i64 %taken
}}
"""

_WATCH = """\
  call void @watch(double %t, ptr %x, ptr %u, ptr %p, ptr %k0)
  %verdict.at = getelementptr double, ptr %k0, i64 {size}
  %verdict = load double, ptr %verdict.at
  %stop = fcmp une double %verdict, 0.0
  br i1 %stop, label %done, label %go
go:"""

_COPY = "declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)\n"

_PREPARED = """\
  %p = alloca double, i64 {room}, align 64
  call void @llvm.memcpy.p0.p0.i64(ptr %p, ptr %given, i64 {bytes}, i1 false)
  %c = getelementptr double, ptr %p, i64 {size}
  call void @prepare(double 0.0, ptr null, ptr null, ptr %p, ptr %c)"""

_SUM = """\
  br label %{name}
{name}:
  %{name}.i = phi i64 [ 0, %{before} ], [ %{name}.next, %{name} ]
{terms}
  %{name}.x.at = getelementptr double, ptr %x, i64 %{name}.i
  %{name}.x = load double, ptr %{name}.x.at
  %{name}.scaled = fmul double %h, {total}
  %{name}.y = fadd double %{name}.x, %{name}.scaled
  %{name}.at = getelementptr double, ptr {result}, i64 %{name}.i
  store double %{name}.y, ptr %{name}.at
  %{name}.next = add i64 %{name}.i, 1
  %{name}.more = icmp slt i64 %{name}.next, {size}
  br i1 %{name}.more, label %{name}, label %{name}.end
{name}.end:"""


def run_function(method: Method, nx: int, nu: int, nrecord: int, width: int = 1,
                 watched: bool = False, prepared: tuple[int, int] | None = None) -> str:
    """Return the text of ``run``, which takes n steps, logs some and returns how many it took.

    `nx`, `nu`, `nrecord` count the numbers that states, one row of inputs and the record take in
    memory, all lanes together.  Where the run is `watched`, ``watch`` computes the first
    derivative, and behind it a number that is not zero where the run is to stop.  Where constants
    are `prepared`, parameters and constants take so many numbers: ``prepare`` computes these, and
    all else finds them behind the parameters.
    """
    attributes = '"prefer-vector-width"="512"' if width >= WIDE else ""
    stages = _stages(method, nx, watched)
    arrays = [f"  %k{i} = alloca double, i64 {nx + 1}, align 64"
              for i in range(len(method.b))]
    arrays += [f"  %y = alloca double, i64 {max(nx, 1)}, align 64",
               f"  %record = alloca double, i64 {max(nrecord, 1)}, align 64"]
    if prepared:
        size, more = prepared
        arrays.append(_PREPARED.format(room=size + more, size=size, bytes=8 * size))
    loop = _LOOP.format(arrays="\n".join(arrays), nu=nu, stages="\n".join(stages),
                        attributes=attributes, stopped=", [ %s, %stages ]" * watched,
                        given="given" if prepared else "p")
    return (_COPY if method.is_map or prepared else "") + loop


def _stages(method: Method, size: int, watched: bool) -> list[str]:
    lines, before = [_WATCH.format(size=size)] * watched, "go" if watched else "stages"
    if not size:
        return [*lines, "  br label %advance"]
    for i, (weights, c) in enumerate(zip(method.a, method.c)):
        if weights:
            lines.append(_weighted_sum(f"stage{i}", before, weights, "%y", size))
            before = f"stage{i}.end"
        at, t = ("%x", "%t") if not weights else ("%y", f"%t{i}")
        if weights:
            lines += [f"  %ch{i} = fmul double {constant(c)}, %h",
                      f"  {t} = fadd double %t, %ch{i}"]
        if i or not watched:
            lines.append(
                f"  call void @derivative(double {t}, ptr {at}, ptr %u, ptr %p, ptr %k{i})")
    lines.append(_next_state(size) if method.is_map
                 else _weighted_sum("result", before, method.b, "%x", size))
    lines.append("  br label %advance")
    return lines


def _next_state(size: int) -> str:
    return ("  call void @llvm.memcpy.p0.p0.i64(ptr %x, ptr %k0, "
            f"i64 {8 * size}, i1 false)")


def _weighted_sum(name: str, before: str, weights: Sequence[float], result: str, size: int) -> str:
    terms, total = [], None
    for j, weight in enumerate(weights):
        if not weight:
            continue
        terms += [f"  %{name}.k{j}.at = getelementptr double, ptr %k{j}, i64 %{name}.i",
                  f"  %{name}.k{j} = load double, ptr %{name}.k{j}.at",
                  f"  %{name}.p{j} = fmul double %{name}.k{j}, {constant(weight)}"]
        if total:
            terms.append(f"  %{name}.s{j} = fadd double {total}, %{name}.p{j}")
        total = f"%{name}.s{j}" if total else f"%{name}.p{j}"
    return _SUM.format(name=name, before=before, terms="\n".join(terms), total=total,
                       result=result, size=size)
