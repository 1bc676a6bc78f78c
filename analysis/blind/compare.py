"""Other methods on the trials of a study: those of today, and the diagnosis less a stage."""

from clie_blocks.analysis.blind.rates import rate
from clie_blocks.analysis.blind.repeats import repeated
from clie_blocks.analysis.blind.score import score
from clie_blocks.analysis.blind.study import merged

FULL = "clie diagnose"
SHOWN = ("trials", "kinds", "top_1", "top_3", "joint", "pair_all_in_top_2", "false_alarm",
         "unknown_detected", "set_coverage", "against_true_model", "seconds")


def methods(baselines, ablations):
    """Names of the methods to run.

    Parameters
    ----------
    baselines, ablations : bool
        Which groups.

    """
    from clie_blocks.analysis.blind.ablations import ABLATIONS
    from clie_blocks.analysis.blind.baselines import BASELINES

    return [*(BASELINES if baselines else ()), *(ABLATIONS if ablations else ())]


def compared(names, places, diagnoses, labels, subset=None, jobs=1):
    """Run methods on trials of a study and score them beside the diagnosis.

    Parameters
    ----------
    names : list of str
        From `methods`.
    places : dict
        Folder of each seed.
    diagnoses, labels : dict
        By seed, then by trial.
    subset : int, optional
        First trials of each seed, whose kinds stand in an order drawn by chance; by default all.
    jobs : int
        Processes.

    Returns
    -------
    list of dict
        One row per method, the diagnosis first.

    """
    chosen = {seed: sorted(labels[seed])[:subset] for seed in places}
    tasks = [(method, places[seed], name) for method in names for seed in places
             for name in chosen[seed]]
    answers = repeated(tasks, jobs)
    by_method = {FULL: diagnoses, **{method: {seed: {
        name: answers[method, places[seed], name] for name in chosen[seed]} for seed in places}
        for method in names}}
    truth = merged(_of(labels, chosen))
    return [row(method, merged(_of(found, chosen)), truth)
            for method, found in by_method.items()]


def _of(entries, chosen):
    """Entries of the chosen trials alone, by seed."""
    return {seed: {name: entries[seed][name] for name in names}
            for seed, names in chosen.items()}


def row(method, answers, truth):
    """Figures of one method."""
    found = score(answers, truth)
    return {"method": method, "ece": found["calibration"]["ece"],
            "failed": rate("error" in answer for answer in answers.values()),
            **{key: found[key] for key in SHOWN}}
