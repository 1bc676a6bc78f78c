"""The two operations of a block function that is called back: the call, and one of its values."""

from clie_blocks.compiled.ir.operations import OPERATIONS, Operation
from clie_blocks.errors import ClieError


class _CallText:
    """Python text of a call, whatever the number of its operands."""

    def format(self, *operands):
        return f"opaque({', '.join(operands)})"


class _NoText:
    def format(self, *operands):
        raise ClieError("an opaque block has no source in C; write it with numpy functions that "
                        "can be traced")


def _refuse(*operands):
    raise ClieError("an opaque block has neither a value nor a derivative outside a program")


CALL = Operation("call", 0, _refuse, _CallText(), _NoText(),
                 lambda ir, index, size, *operands: ir.call_back(index, int(size), operands),
                 _refuse)
PICK = Operation("pick", 2, _refuse, "{0}[int({1})]", _NoText(),
                 lambda ir, values, k: ir.load(values.name, int(k), False), _refuse)
CALLBACKS = {"call": CALL, "pick": PICK}


def operation(name):
    """Return the operation of that name, whether of the table or a call."""
    return OPERATIONS[name] if name in OPERATIONS else CALLBACKS[name]
