"""Fixed-step Runge-Kutta methods as Butcher tables, under Simulink's names."""

from dataclasses import dataclass

from clie_blocks.errors import ClieError, nearest


@dataclass(frozen=True)
class Method:
    """One explicit Runge-Kutta method.

    Parameters
    ----------
    name, title : str
        Simulink's name and the usual name.
    order : int
        Order of the global error in the step.
    a : tuple of tuple of float
        Row i holds the weights of the derivatives 0..i-1 at stage i.
    b, c : tuple of float
        Weights of the result and times of the stages, in steps.
    is_map : bool
        The one stage is the next state itself: a system in discrete time.

    """

    name: str
    title: str
    order: int
    a: tuple[tuple[float, ...], ...]
    b: tuple[float, ...]
    c: tuple[float, ...]
    is_map: bool = False


METHODS = {method.name: method for method in (
    Method("ode1", "Euler", 1, ((),), (1.0,), (0.0,)),
    Method("ode2", "Heun", 2, ((), (1.0,)), (1 / 2, 1 / 2), (0.0, 1.0)),
    Method("ode3", "Bogacki-Shampine", 3, ((), (1 / 2,), (0.0, 3 / 4)),
           (2 / 9, 1 / 3, 4 / 9), (0.0, 1 / 2, 3 / 4)),
    Method("ode4", "Runge-Kutta", 4, ((), (1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0)),
           (1 / 6, 1 / 3, 1 / 3, 1 / 6), (0.0, 1 / 2, 1 / 2, 1.0)),
    Method("ode5", "Dormand-Prince", 5, (
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656)),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
        (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)),
)}
SAMPLED = Method("sampled", "difference equation", 0, ((),), (1.0,), (0.0,), is_map=True)


def method_named(name: str) -> Method:
    """Return the method of that name.

    Raises
    ------
    ClieError
        If there is no such method.

    """
    if name not in METHODS:
        raise ClieError(f"no method {name!r}; {nearest(name, METHODS)}")
    return METHODS[name]
