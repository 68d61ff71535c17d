"""The converged light that all bakes are compared with: Cycles just inside the chosen corners, kept in a file."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import UnreadableFileError
from ..files.write_files import replace_file
from .cycles_bake import bake_with_cycles, light_of
from .face_copies import copy_in
from .scene import ComparedScene

#: Counted up when references of before are no longer what would be made now.
VERSION = 1

#: samples of the first round; each round has twice as many as that before
FIRST_SAMPLES = 64


@dataclass(frozen=True)
class Reference:
    """E/pi at M corners, twice, with seeds of their own.

    halves   (2, M, 3); ``samples`` a corner in each; ``seconds`` of wall time that they took; ``rounds`` of seeds
    """

    halves: np.ndarray
    samples: int
    seconds: float
    rounds: int

    @property
    def light(self) -> np.ndarray:
        """The RGB sum (M,)."""
        return self.halves.sum(axis=2).mean(axis=0)

    @property
    def noise(self) -> np.ndarray:
        """The absolute noise (M,) of :attr:`light`."""
        first, second = self.halves.sum(axis=2)
        return np.abs(first - second) / 2

    @property
    def relative_noise(self) -> float:
        """Median over the lit corners, infinite without samples."""
        lit = self.light > 0
        return float(np.median(self.noise[lit] / self.light[lit])) if lit.any() else 0.0


def reference_key(path: Path, compared: ComparedScene) -> str:
    """What a reference belongs to: the scene file and its libraries, byte by byte, Blender, and the chosen corners."""
    digest = hashlib.sha256(f"{VERSION} {bpy.app.version_string} {compared.objects}".encode())
    digest.update(compared.chosen.tobytes())
    for file in (path, *(Path(bpy.path.abspath(library.filepath)) for library in bpy.data.libraries)):
        digest.update(file.read_bytes() if file.exists() else b"")
    return digest.hexdigest()[:16]


def converged_reference(
    compared: ComparedScene, file: Path, key: str, most_samples: int, noise: float
) -> Generator[str, None, Reference]:
    """The reference that ``file`` keeps, made there if need be, and better than it was if that is asked for.

    Rounds of samples are added until the median relative noise is at most ``noise``, or the next round would make it
    more than ``most_samples`` in each half. Yields sentences. Raises UnreadableFileError when the file is another
    scene's.
    """
    reference = _kept(file, key) or Reference(np.zeros((2, len(compared.chosen), 3)), 0, 0.0, 0)
    if reference.samples:
        yield f"Reference from {file}: {_described(reference)}"
    faces = np.zeros(len(compared.faces.sizes), bool)
    faces[compared.faces.face[compared.chosen]] = True
    scene = bpy.context.scene
    with copy_in(scene, compared.faces.taken(faces).just_inside(compared.scene_radius)) as copy:
        while reference.samples == 0 or reference.relative_noise > noise:
            samples = min(FIRST_SAMPLES << reference.rounds, most_samples - reference.samples)
            if samples <= 0 or (reference.rounds and samples < FIRST_SAMPLES << reference.rounds):
                break
            reference = _better(reference, copy, samples)
            replace_file(file, partial(_keep, key, reference))
            yield f"Reference: {_described(reference)}"
    return reference


def _better(reference: Reference, copy: bpy.types.Object, samples: int) -> Reference:
    """With ``samples`` more in each half."""
    baked, seconds = [], reference.seconds
    for half in (0, 1):
        run = bake_with_cycles([copy], samples, seed=1000 + 2 * reference.rounds + half)
        seconds += run.seconds
        baked.append(light_of(copy))
    share = samples / (samples + reference.samples)
    halves = (1.0 - share) * reference.halves + share * np.array(baked)
    return replace(
        reference, halves=halves, samples=reference.samples + samples, seconds=seconds, rounds=reference.rounds + 1
    )


def _described(reference: Reference) -> str:
    return (
        f"2 x {reference.samples} samples at {reference.halves.shape[1]} corners, "
        f"median noise {100 * reference.relative_noise:.2g} %, made in {reference.seconds:.0f} s"
    )


def _keep(key: str, reference: Reference, path: Path) -> None:
    with open(path, "wb") as file:
        np.savez_compressed(file, key=np.array(key), **vars(reference))


def _kept(path: Path, key: str) -> Reference | None:
    if not path.exists():
        return None
    try:
        with np.load(path) as arrays:
            if str(arrays["key"]) != key:
                raise UnreadableFileError(
                    f"The reference '{path}' is that of another scene, Blender or choice of corners: name another file."
                )
            return Reference(arrays["halves"], int(arrays["samples"]), float(arrays["seconds"]), int(arrays["rounds"]))
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise UnreadableFileError(f"'{path}' is not a reference that this command made: name another file.") from error
