"""A sampled loop as LLVM text: before each step, the maps of the parts whose ticks are due."""

from collections.abc import Mapping
from dataclasses import replace

from clie_blocks.compiled.codegen.builder import constant
from clie_blocks.compiled.codegen.lane_layout import Memory
from clie_blocks.compiled.codegen.llvm import emit, loader
from clie_blocks.compiled.codegen.methods import Method
from clie_blocks.compiled.codegen.native import module
from clie_blocks.compiled.codegen.sine_cosine import LaneBuilder
from clie_blocks.compiled.codegen.stepper import SIGNATURE, STEP
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.symbols import Expression
from clie_blocks.compiled.sampling.tracing import Sampling

_RINT = ("declare double @llvm.rint.f64(double) "
         "nounwind willreturn memory(none)")

_LOOP = SIGNATURE + """ {{
entry:
{counts}
""" + STEP + """\
{maps}
  br label %advance
advance:
  %taken = call i64 @steps(i64 1, double %h, double %t0, i64 %count, ptr %x, ptr %u, ptr %p,
                           i64 %every, i64 %nlog, ptr %slots, ptr %row)
  %log.phase = urem i64 %count, %every
  %logged = icmp eq i64 %log.phase, 0
  %filled = select i1 %logged, i64 %nlog, i64 0
  %row.next = getelementptr double, ptr %row, i64 %filled
  %s.next = add i64 %s, %taken
  %some = icmp sgt i64 %taken, 0
  %left = icmp slt i64 %s.next, %n
  %more = and i1 %some, %left
  br i1 %more, label %step, label %done
done:
  %total = phi i64 [ 0, %entry ], [ %s.next, %advance ]
  ret i64 %total
}}
"""

_COUNT = """\
  %ratio{k} = fdiv double {period}, %h
  %round{k} = call double @llvm.rint.f64(double %ratio{k})
  %between{k} = fptosi double %round{k} to i64
  %last{k} = fsub double %round{k}, {one}"""

_DELAY = """\
  %nominal{k} = icmp eq i64 %phase{k}, 0
  %wait{k}.at = getelementptr double, ptr %x, i64 {wait}
  br i1 %nominal{k}, label %late{k}, label %waited{k}
late{k}:
  %jitter{k}.at = getelementptr double, ptr %u, i64 {jitter}
  %jitter{k} = load double, ptr %jitter{k}.at
  %late{k}.ratio = fdiv double %jitter{k}, %h
  %late{k}.steps = call double @llvm.rint.f64(double %late{k}.ratio)
  %late{k}.some = fcmp ogt double %late{k}.steps, {zero}
  %late{k}.least = select i1 %late{k}.some, double %late{k}.steps, double {zero}
  %late{k}.far = fcmp ogt double %late{k}.least, %last{k}
  %late{k}.kept = select i1 %late{k}.far, double %last{k}, double %late{k}.least
  store double %late{k}.kept, ptr %wait{k}.at
  br label %waited{k}
waited{k}:
  %wait{k}.real = load double, ptr %wait{k}.at
  %wait{k} = fptosi double %wait{k}.real to i64"""

_MAP = """\
  br label %part{k}
part{k}:
  %phase{k} = urem i64 %count, %between{k}
{delay}
  %due{k} = icmp eq i64 %phase{k}, {wait}
  br i1 %due{k}, label %tick{k}, label %after{k}
tick{k}:
  call void @map{k}(double %t, ptr %x, ptr %u, ptr %p)
  br label %after{k}
after{k}:"""


def sampled_module(layout: Layout, method: Method, memory: Memory, sampling: Sampling) -> str:
    """Return the LLVM text of a sampled loop."""
    moving = replace(layout, derivatives=layout.derivatives[:sampling.moving])
    plant = module(moving, method, memory).replace("define i64 @run(", "define i64 @steps(")
    maps = [_map(f"map{k}", stored, memory) for k, stored in enumerate(layout.maps)]
    declared = {_RINT}.union(*(declarations for _, declarations in maps))
    return "\n".join([*sorted(line for line in declared if line not in plant), plant,
                      *(text for text, _ in maps), _loop(layout, memory, sampling)])


def _loop(layout: Layout, memory: Memory, sampling: Sampling) -> str:
    counts, maps = [], []
    for k, tick in enumerate(sampling.ticks):
        counts.append(_COUNT.format(k=k, period=constant(tick.period), one=constant(1.0)))
        delay = "" if tick.jitter is None or tick.wait is None else _DELAY.format(
            k=k, wait=memory.offset("x", tick.wait), jitter=tick.jitter, zero=constant(0.0))
        maps.append(_MAP.format(k=k, delay=delay, wait=f"%wait{k}" if delay else "0"))
    return _LOOP.format(counts="\n".join(counts), maps="\n".join(maps), nu=layout.nu,
                        given="p")


def _map(name: str, stored: Mapping[int, Expression], memory: Memory) -> tuple[str, set[str]]:
    """Text and declarations of ``name(t, x, u, p)``, which changes x once all is computed."""
    builder = LaneBuilder(memory.width)
    values = emit(builder, stored.values(), loader(builder, memory))
    for state, value in zip(stored, values):
        builder.store(value, "%x", memory.offset("x", state), memory.varies("x", state))
    body = "\n".join(builder.lines)
    text = (f"define void @{name}(double %t, ptr noalias %x, ptr noalias %u, ptr noalias %p) "
            f"noinline {{\n{body}\n  ret void\n}}\n")
    return text, builder.declarations
