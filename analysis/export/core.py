"""The block of a joint as text of its own: a C99 file with a header, and a Python listing."""

from __future__ import annotations

import dataclasses
import json
import re
import textwrap
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.export.correction import before
from clie_blocks.analysis.export.events import parameters_of_one_log
from clie_blocks.analysis.export.joint_block import INPUTS, OUTPUTS, JointBlock

if TYPE_CHECKING:
    import jinja2

    from clie_blocks.compiled.program import Program

TEMPLATES = Path(__file__).parent


@dataclasses.dataclass(frozen=True, eq=False)
class Core:
    """The compiled block of one joint.

    Parameters
    ----------
    block : JointBlock
        The block.
    name : str
        Prefix of its functions, an identifier.

    """

    block: JointBlock
    name: str

    @cached_property
    def program(self) -> Program:
        """The block as a program, checked against the block at random points."""
        from clie_blocks.compiled import compile_diagram

        return compile_diagram(self.block.system(self.name))

    @property
    def parameters(self) -> list[tuple[str, float]]:
        """Every parameter with its value, in the order of the program's."""
        return [(key, float(value)) for key, values in self.program.params.items()
                for value in np.ravel(values)]

    @property
    def parameter_places(self) -> dict[str, int]:
        """Place of each parameter among all; of one for each joint, that of this joint."""
        found, first = {}, 0
        for key, values in self.program.params.items():
            found[key] = first + (self.block.k if np.size(values) > 1 else 0)
            first += np.size(values)
        return found

    @property
    def of_one_log(self) -> list[tuple[str, str, int, str]]:
        """Parameters of one log: name, name in C, place among all, and what it says."""
        return [(key, f"{self.upper}_{identifier(key).upper()}", self.parameter_places[key], says)
                for key, says in parameters_of_one_log(self.block.effects)]

    @property
    def values(self) -> list[float]:
        """Values of the parameters."""
        return [value for _, value in self.parameters]

    @property
    def upper(self) -> str:
        """Its name as the constants of C have it."""
        return self.name.upper()

    @property
    def class_name(self) -> str:
        """Its name as a class has it."""
        return "".join(word[:1].upper() + word[1:] for word in self.name.split("_"))

    @property
    def quoted(self) -> str:
        """Name of the joint as a string of C, Python or YAML."""
        return json.dumps(self.block.joint.name, ensure_ascii=False)

    @property
    def command_per_force(self) -> float:
        """Logged command per torque that a model by the datasheet puts on the joint."""
        joint = self.block.joint
        return 1.0 / (before(joint, "gear") * before(joint, "gain"))

    @property
    def states(self) -> list[str]:
        """Name of every state."""
        return [label for _, label in self.program.states]

    @property
    def effects(self) -> str:
        """What it holds, in words."""
        return ", ".join(map(repr, self.block.effects)) or "no effect"

    def c_source(self) -> str:
        """Return the C99 file: the program's own functions, and one that advances a joint."""
        return f"{self.program.source('c')}\n{self._filled('joint.c.j2')}"

    def c_header(self) -> str:
        """Return the header of the C99 file."""
        return self._filled("joint.h.j2")

    def static_source(self) -> str:
        """Return header and C99 file as one text, of functions that no other file sees."""
        text = self.c_source().replace(f'#include "{self.name}.h"\n', self.c_header())
        return re.sub(r"^(?=(?:void|double) )", "static ", text, flags=re.MULTILINE)

    def member_source(self) -> str:
        """Return that text as members of a class in C++ or CUDA, without the preprocessor."""
        text = re.sub(r"^#.*\n|^static [^{;]*;\n", "", self.static_source(), flags=re.MULTILINE)
        text = text.replace(f"{self.upper}_STEP", repr(self.block.step))
        return re.sub(r"^static ", "static CUDA_CALLABLE ", text, flags=re.MULTILINE)

    @property
    def size(self) -> int:
        """Numbers in the memory of a joint in C: time, states, parameters, outputs."""
        return 1 + max(len(self.states), 1) + len(self.parameters) + len(OUTPUTS)

    @property
    def places(self) -> dict[str, int]:
        """Place of each parameter in that memory."""
        first = 1 + max(len(self.states), 1)
        return {key: first + place for key, place in self.parameter_places.items()}

    def python_source(self) -> str:
        """Return a function that makes the block's two functions, as an indented listing."""
        return self._listing("python", "")

    def torch_source(self) -> str:
        """Return the same for tensors; it takes the function that makes a constant."""
        return self._listing("torch", "number")

    @property
    def rows(self) -> dict[str, int]:
        """Place of each output in what the Python listing observes."""
        slots = self.program.description.slots
        return {name: slots[f"{name}[0]"] for name in OUTPUTS}

    @property
    def inertia(self) -> float:
        """Inertia about the joint outside of the block."""
        return self.block.joint.inertia - self.block.motor_inertia

    def _listing(self, language: str, arguments: str) -> str:
        listing = self.program.source(language)
        body = listing[listing.index('"""\n', 3) + 4:]
        return (f"def _{self.name}({arguments}):\n{textwrap.indent(body.rstrip(), '    ')}\n"
                f"    return derivative, observe\n")

    def _filled(self, template: str) -> str:
        return fill(template, core=self)


def core(block: JointBlock, name: str | None = None) -> Core:
    """Return the core of a joint's block, under the name of the joint."""
    return Core(block, identifier(name or block.joint.name))


def identifier(text: str) -> str:
    """Return a name as C and Python take one."""
    clean = re.sub(r"\W", "_", text, flags=re.ASCII)
    return f"joint_{clean}" if not clean[:1].isalpha() else clean


def fill(template: str, **values: Any) -> str:
    """Return a template of this folder with values filled in; an unknown name is an error."""
    return _templates().get_template(template).render(inputs=INPUTS, outputs=OUTPUTS, **values)


@cache
def _templates() -> jinja2.Environment:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    environment.filters["text"] = lambda text: re.sub(r"\s+", " ", str(text)).replace("*/", "* /")
    return environment
