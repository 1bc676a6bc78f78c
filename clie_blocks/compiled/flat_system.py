"""A compiled diagram handed back to python-control as one flat block."""

import control as ct


def flat_system(program, engine, shown, vector):
    """Return a program as one `control.NonlinearIOSystem`.

    Parameters
    ----------
    program : Program
        Gives name, labels and default parameters.
    engine : NativeEngine or PythonEngine
        Computes derivatives and the record.
    shown : list of int
        Entries of the record that are the outputs.
    vector : callable
        ``vector(params)`` gives the values of all parameter slots.

    """
    values = _LastValues(vector)

    def update(t, x, u, params):
        return engine.derivative(t, x, u, values.of(params))

    def output(t, x, u, params):
        return engine.observe(t, x, u, values.of(params))[shown]

    return ct.nlsys(
        update, output, name=program.name, params=program.params, dt=program.period or 0,
        inputs=program.inputs or 0, outputs=program.outputs,
        states=[f"{block}_{label}" for block, label in program.states] or 0)


class _LastValues:
    """The parameter values of the dictionary that python-control passed last."""

    def __init__(self, vector):
        self._vector, self._params, self._values = vector, None, None

    def of(self, params):
        # python-control makes one dictionary per simulation and passes it at every call
        if params is not self._params:
            self._params, self._values = params, self._vector(params)
        return self._values
