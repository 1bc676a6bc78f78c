"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

from clie_blocks.analysis.gap.fit import bench_of, fit
from clie_blocks.analysis.gap.hypothesis import hypothesis


def baseline(problem):
    """Fit inertia, damping and load of every joint, with the datasheet as prior information.

    Returns
    -------
    bench : Bench
        Whitening for the fitted loop.
    base : Fit
        The refitted nominal model.

    """
    start = hypothesis(problem, ())
    rough = fit(start, bench_of(problem, start))
    bench = bench_of(problem, rough.hypothesis)
    return bench, fit(rough.hypothesis, bench)
