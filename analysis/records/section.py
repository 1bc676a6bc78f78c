"""A section of a robot file: fields that are checked when it is built."""

from __future__ import annotations

import dataclasses

from clie_blocks.analysis.records.fields import check_value
from clie_blocks.output import short_repr


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Section:
    """Checks and freezes every field when built."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None and field.metadata:
                where = f"{type(self).__name__}.{field.name}"
                object.__setattr__(self, field.name, check_value(value, field, where))

    def __repr__(self) -> str:
        return short_repr(self, [field.name for field in dataclasses.fields(self)])
