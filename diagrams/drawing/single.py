"""A single block as a diagram of its own, so that it can be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clie_blocks.labels import DiagramError

if TYPE_CHECKING:
    import control as ct


def alone(block: ct.InputOutputSystem) -> ct.InterconnectedSystem:
    """Diagram of one block, whose ports are its own."""
    import control as ct

    if not isinstance(block, ct.InputOutputSystem):
        raise DiagramError(f"cannot draw {block!r}: it is no block of python-control; draw what "
                           "ct.nlsys, ct.ss, ct.tf or interconnect returns")
    if not isinstance(block, ct.NonlinearIOSystem):
        block = _with_ports(block)
    return ct.interconnect([block], inplist=[f"{block.name}.{one}" for one in block.input_labels],
                           inputs=block.input_labels,
                           outlist=[f"{block.name}.{one}" for one in block.output_labels],
                           outputs=block.output_labels, name=f"{block.name}_alone")


def _with_ports(block: ct.InputOutputSystem) -> ct.NonlinearIOSystem:
    """Something to draw with the ports of a transfer function or a frequency response."""
    import control as ct

    if isinstance(block, ct.TransferFunction):
        try:
            return ct.ss(block, name=block.name, inputs=block.input_labels,
                         outputs=block.output_labels)
        except (ValueError, TypeError, ImportError, ct.ControlMIMONotImplemented):
            pass  # improper, or several channels without slycot: a box with its name
    return ct.nlsys(None, lambda t, x, u, params: u, name=block.name, inputs=block.input_labels,
                    outputs=block.output_labels)
