"""Parts of the engine on their own: one lane, joints in a row."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import healthy_parameters

H = 1e-4  # s


@pytest.fixture
def one_lane():
    """Parameters of one lane, neutral but for those stated."""
    def make(n=1, **parameters):
        return {key: np.broadcast_to(np.asarray(parameters.get(key, value), float), (1, n)).copy()
                for key, value in healthy_parameters(n).items()}
    return make


@pytest.fixture
def along():
    """Answers of a part to a path, sampled every `H`."""
    def answers(part, path):
        speed = np.diff(path, prepend=path[0]) / H
        return np.array([part(Moment(i * H, np.array([[q]]), np.array([[dq]]),
                                     np.zeros((1, 1))))[0, 0]
                         for i, (q, dq) in enumerate(zip(path, speed))])
    return answers
