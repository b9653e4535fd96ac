"""What a film under the contact would read: pressure of a stated contact surface at a force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError
from forcemap.recordings.film import Film

_LARGEST_AREA = 100.0  # [cm^2]; larger contacts are no edge, knob or tool
_MARGIN = 3  # cells of the film around the contact


@dataclass(frozen=True)
class ContactSurface:
    """A flat square face of the robot, pressed straight into the pad: the same pressure everywhere under it.

    Real faces press more at their edges; the lab does not know by how much.

    Parameters
    ----------
    area : float
        Its area [cm^2].

    Raises
    ------
    InputError
        An area that is not above 0 and at most 100 cm^2.
    """

    area: float

    def __post_init__(self) -> None:
        if not 0 < self.area <= _LARGEST_AREA:
            raise InputError(f"contact area: found {self.area:g} cm^2, expected above 0 and at most 100")

    def pressure(self, force: FloatArray) -> FloatArray:
        """Pressure p = F / A [N/cm^2] under a force [N], of its shape."""
        return np.asarray(force / self.area)


@dataclass(frozen=True, kw_only=True)
class SimulatedFilm:
    """A film, and how its readings differ from the pressure.

    Parameters
    ----------
    film : Film
        Range and smallest pressure it shows; half of its error is spent on the scale that all its readings share.
    pitch : float
        Distance between its cells [m].
    noise : float
        Standard deviation of the noise of a cell, as a share of the reading.
    """

    film: Film
    pitch: float = 1e-3
    noise: float = 0.02

    def scale(self, rng: np.random.Generator) -> float:
        """Reading over pressure of one such film."""
        return float(1 + rng.uniform(-0.5, 0.5) * self.film.error_or_default)

    def readings(self, surface: ContactSurface, force: float, scale: float, rng: np.random.Generator) -> FloatArray:
        """The cells that one impact leaves, shape (n, n) [N/cm^2]: the largest pressure each of them saw.

        Parameters
        ----------
        surface : ContactSurface
            What presses.
        force : float
            Largest force of the impact [N].
        scale : float
            Reading over pressure.
        rng : numpy.random.Generator
            Source of where the contact lies between cells, and of noise.
        """
        side = math.sqrt(surface.area) / 100 / self.pitch  # in cells
        count = math.ceil(side) + 2 * _MARGIN
        start = _MARGIN + rng.uniform(0, count - 2 * _MARGIN - side, 2)
        edges = np.arange(count)
        rows, columns = (np.clip(np.minimum(edges + 1, at + side) - np.maximum(edges, at), 0, 1) for at in start)
        true = float(surface.pressure(np.asarray(force))) * rows[:, None] * columns
        read = scale * true * (1 + rng.normal(0, self.noise, true.shape))
        read[read < np.nan_to_num(self.film.least)] = 0.0
        return np.asarray(np.clip(read, 0.0, self.film.range))


def film_text(readings: FloatArray, pitch: float, origin: str) -> str:
    """Text of the file of one film; its first line says that it was simulated, and how."""
    rows = "".join(";".join(f"{cell:.2f}" for cell in row) + "\n" for row in readings.tolist())
    return f"# {origin}\n# unit: N/cm2\n# pitch: {1000 * pitch:g} mm\n{rows}"
