"""Fit a fault of a camera that is known, as benchmarks and tests of the check do."""

from tracker.calibration.check.diagnosis import diagnosis_of
from tracker.calibration.check.fault_search import FaultSearch, FoundFault, Selection, prior_sigmas


def fit_fault(frames, parameters, fps, fault):
    """Fit one fault that is known to be there, however little it is worth; the arguments are those of `diagnose`."""
    search = FaultSearch(frames, parameters, prior_sigmas(fps))
    before = search.fitted(search.begun().state, ())
    first = search.refitted(before, (fault,))
    return diagnosis_of(search.settled(Selection((FoundFault(fault, before.cost - first.cost, {}),), first)))
