"""Every example of docs/compiled.md runs, in the order of the page."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "compiled.md"


@pytest.mark.filterwarnings("ignore::clie_blocks.compiled.OpaqueBlockWarning")
def test_examples_of_the_page_run(capsys):
    scope = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL):
        exec(block, scope)
    assert "Systems have incompatible timebases" in capsys.readouterr().out
    assert scope["slow"].callbacks
    np.testing.assert_allclose(scope["response"].outputs[:, -1], [1.0, 0.8], atol=0.2)
