"""Every threshold of the diagnosis as one value, printed in the report and open to sweeps."""

import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.method.backlash import BacklashMethod
from clie_blocks.analysis.gap.method.calibration import Calibration, load_calibration
from clie_blocks.analysis.gap.method.fitting import FittingMethod
from clie_blocks.analysis.gap.method.search import SearchMethod
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.errors import ClieError, nearest


class Threshold(NamedTuple):
    """One threshold: its name ``group.field``, value, unit, and the reason for its value."""

    name: str
    value: Any
    unit: str
    reason: str


@dataclasses.dataclass(frozen=True, repr=False)
class Method:
    """Thresholds of the stages, one group each.

    Parameters
    ----------
    fitting : FittingMethod
        Residuals and fits.
    search : SearchMethod
        Which causes are fitted, and how far.
    backlash : BacklashMethod
        The explanation in a softened loop.
    calibration : Calibration
        From excess to odds; partly learned.
    verdict : VerdictMethod
        What counts as evidence.
    assessment : AssessmentMethod
        What is reported of the corrected model.

    """

    fitting: FittingMethod = FittingMethod()
    search: SearchMethod = SearchMethod()
    backlash: BacklashMethod = BacklashMethod()
    calibration: Calibration = dataclasses.field(default_factory=load_calibration)
    verdict: VerdictMethod = VerdictMethod()
    assessment: AssessmentMethod = AssessmentMethod()

    def __repr__(self) -> str:
        changed = [f"{one.name}={one.value!r}" for one, usual in
                   zip(self.thresholds(), METHOD.thresholds()) if one.value != usual.value]
        return f"Method({', '.join(changed) or 'the usual thresholds'})"

    def thresholds(self) -> Iterator[Threshold]:
        """All thresholds with unit and reason, group by group."""
        for group in dataclasses.fields(self):
            values = getattr(self, group.name)
            for field in dataclasses.fields(values):
                yield Threshold(f"{group.name}.{field.name}", getattr(values, field.name),
                                field.metadata["unit"], field.metadata["reason"])

    def with_values(self, **values: Any) -> "Method":
        """Return the method with other values, e.g. ``with_values(**{"search.leaders": 12})``.

        Raises
        ------
        ClieError
            For a name that is no threshold; names the nearest one.

        """
        known = [one.name for one in self.thresholds()]
        changes: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            if name not in known:
                raise ClieError(f"no threshold is called {name!r}; {nearest(name, known)}")
            group, _, field = name.partition(".")
            changes.setdefault(group, {})[field] = value
        return dataclasses.replace(self, **{
            group: dataclasses.replace(getattr(self, group), **fields)
            for group, fields in changes.items()})


METHOD = Method()
