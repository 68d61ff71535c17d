"""Named errors: each message says in one sentence what is wrong and what the user can do.

The add-on and the command line catch :class:`DetpError` alone and show its text as it is.
"""


class DetpError(Exception):
    """Base of every error that is the input's or the machine's fault, not the program's."""


class InvalidArrayError(DetpError, ValueError):
    """An array handed to the core has the wrong shape, type or non-finite values."""


class InvalidSettingError(DetpError, ValueError):
    """A bake setting is outside its range (photons < 1, radius <= 0, unknown gatherer, ...)."""


class NoMeshError(DetpError):
    """There is no surface to bake."""


class NoLightError(DetpError):
    """Nothing in the scene emits light."""


class NothingSelectedError(DetpError):
    """The selection to bake holds no mesh object."""


class ObjectNotFoundError(DetpError):
    """A named object does not exist, or is not a mesh that a render shows."""


class LightGroupNotFoundError(DetpError):
    """A named light group is not among those that were baked."""


class NotBakedError(DetpError):
    """The meshes have no light yet, where some is to be used."""


class EditModeError(DetpError):
    """A mesh is open in Edit Mode, where its data cannot be read or written."""


class SceneNotFoundError(DetpError):
    """A named scene or view layer does not exist."""


class AttributeNameTakenError(DetpError):
    """The attribute name belongs to an attribute of another type or domain."""


class UnreadableFileError(DetpError):
    """A scene file is missing, unreadable, not a .blend, or from a newer Blender."""


class OutOfMemoryError(DetpError):
    """A bake takes more memory than the machine has free."""


class ClusterError(DetpError):
    """A bake's workers cannot be reached, do not suit, or are gone."""


class NotUpdatableError(DetpError):
    """The light of a scene cannot be updated, for a ``reason``: a clause without a capital letter and a full stop."""

    def __init__(self, reason: str):
        super().__init__(f"{reason[0].upper()}{reason[1:]}: bake anew.")
        self.reason = reason


class SessionTooLargeError(NotUpdatableError):
    """What an update of a bake needs of it is too much to be kept."""


class SceneBusyError(DetpError):
    """Blender cannot evaluate the scene now, because it is rendering already."""


class UnwritableFileError(DetpError):
    """An output cannot be written."""


class DiskFullError(UnwritableFileError):
    """An output has no room: the disk is full, or a quota or limit is reached."""
