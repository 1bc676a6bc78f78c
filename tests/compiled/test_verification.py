"""Every compile is checked against the diagram."""

import pytest

from clie_blocks.compiled import CompiledDifferenceError, compile_diagram


def test_a_block_that_is_not_pure_is_found(make_block):
    calls = []

    def output(t, x, u, params):
        calls.append(1)
        return u * (1.0 if len(calls) > 2 else 2.0)  # twice as it is traced

    with pytest.raises(CompiledDifferenceError, match=r"compiled output of y\[0\] is"):
        compile_diagram(make_block("counter", None, output))
