"""The frames of an animation, and those of them at which light is baked."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.errors import InvalidSettingError

#: Blender's own limits
_LEAST, _MOST = -1048574, 1048574


@dataclass(frozen=True)
class Frames:
    """The frames from ``first`` to ``last``, of which every so many have light of their own, and both ends.

    Raises InvalidSettingError on anything else.
    """

    first: int
    last: int
    every: int = 1

    def __post_init__(self):
        if not _LEAST <= self.first < self.last <= _MOST:
            raise InvalidSettingError(
                f"An animation needs at least two frames, in their order, not {self.first} to {self.last}."
            )
        if self.every < 1:
            raise InvalidSettingError(f"Light can be baked every 1 frame or more, not every {self.every}.")

    @property
    def keys(self) -> tuple[int, ...]:
        """The frames that are baked, ascending; the last step may be shorter."""
        return (*range(self.first, self.last, self.every), self.last)

    def until(self, count: int) -> Frames:
        """The frames as far as the key of that ``count``, of at least two."""
        return Frames(self.first, self.keys[count - 1], self.every)
