"""Records of a bake of which some no longer hold, and others in their place."""

from __future__ import annotations

import numpy as np

from ..gather.records import Landings, RecordFinder


class PatchedRecords:
    """The cells of ``base`` that are ``kept`` (C,), and behind all of its rows those of ``fresh`` records.

    Attribute ``after`` (C + 1,): the row here of each cell of ``base``, -1 where none tells of its light any more.
    """

    def __init__(self, base: RecordFinder, fresh: RecordFinder, kept: np.ndarray):
        self._base, self._fresh, self._kept = base, fresh, np.append(kept, False)
        anew = fresh.rows(base.numbers)
        anew[anew >= 0] += len(base)
        self.after = np.append(np.where(kept, np.arange(len(base)), anew), -1)

    def __len__(self) -> int:
        return len(self._base) + len(self._fresh)

    def find(self, landings: Landings, lengths: np.ndarray) -> np.ndarray:
        """The cell (K,) whose records tell of the light at ``landings`` (K), see :meth:`.RecordFinder.find`."""
        cell = self._base.find(landings, lengths)
        cell[~self._kept.take(cell)] = -1
        left = np.flatnonzero(cell < 0)
        anew = self._fresh.find(landings.taken(left), lengths.take(left))
        cell[left] = np.where(anew < 0, -1, anew + len(self._base))
        return cell

    def joined(self, base: np.ndarray, fresh: np.ndarray) -> np.ndarray:
        """Values (2 C, 6) at all records, from those at ``base`` and at ``fresh`` ones, half by half."""
        halves = (np.split(base, 2), np.split(fresh, 2))
        return np.concatenate([part[half] for half in (0, 1) for part in halves])
