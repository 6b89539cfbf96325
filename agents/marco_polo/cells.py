"""The uniform cell decomposition of the area, and the cells that a platform can occupy (C_free, section 2.2.2).

Cells are numbered row by row from the corner with the least x and y: cell = row * columns + column. A platform is a
square that moves without turning, its centre at the middle of a cell. It can occupy a cell if the square does not
overlap an obstacle; to touch one is allowed. Obstacles are convex polygons: walls and boxes, the platforms of other
sensors, and zones of poor communication, which are virtual obstacles. An aerial platform ignores walls and boxes.

Source: dissertation, section 2.2.2; LaValle 2006, [12].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, sqrt

import numpy as np
import shapely
from numpy.typing import NDArray

from agents.pursuit import Place
from agents.pursuit.law import Area

Polygon = Sequence[Place]       # corners [m] in either direction, the last is not the first
Mask = NDArray[np.bool_]

TOUCHING = 1e-9                 # overlap of a platform with an obstacle, relative to its side, that counts as touching
MOST_CELLS = 250_000            # whose obstacle map and connectivity graph take seconds
WHOLE = 1e-9                    # relative deviation of the area's sides from whole numbers of cells


@dataclass(frozen=True)
class Cells:
    """Square cells of side `side_m` over a rectangle whose sides are multiples of it."""

    area: Area
    side_m: float

    def __post_init__(self) -> None:
        if not 0 < self.side_m < inf:
            raise ValueError(f"cell_m={self.side_m}: expected more than 0")
        (west, east), (south, north) = self.area.x_m, self.area.y_m
        area_m2 = (east - west) * (north - south)
        if (cells := area_m2 / self.side_m ** 2) > MOST_CELLS * (1 + WHOLE):
            raise ValueError(f"cell_m={self.side_m}: makes {cells:.3g} cells, and {MOST_CELLS} are the most; take "
                             f"{sqrt(area_m2 / MOST_CELLS):.4g} m or more")
        for name, (low, high) in (("width", self.area.x_m), ("height", self.area.y_m)):
            count = max(1, round((high - low) / self.side_m))
            if abs((high - low) / self.side_m - count) > WHOLE * count:
                raise ValueError(f"cell_m={self.side_m}: the area's {name}, {high - low:g} m, is not a whole number of "
                                 f"cells; {(high - low) / count:.9g} m gives {count}")

    @cached_property
    def columns(self) -> int:
        return round((self.area.x_m[1] - self.area.x_m[0]) / self.side_m)

    @cached_property
    def rows(self) -> int:
        return round((self.area.y_m[1] - self.area.y_m[0]) / self.side_m)

    @cached_property
    def centroids_m(self) -> NDArray[np.float64]:
        """Middles of all cells, shape (rows * columns, 2)."""
        x = self.area.x_m[0] + (np.arange(self.columns) + 0.5) * self.side_m
        y = self.area.y_m[0] + (np.arange(self.rows) + 0.5) * self.side_m
        return np.stack([np.tile(x, self.rows), np.repeat(y, self.columns)], axis=1)

    def cell_at(self, place: Place) -> int:
        """Return the cell that contains a place; cells are half open, and a place outside counts as the nearest inside.

        ValueError for a place that is not finite."""
        if not (isfinite(place[0]) and isfinite(place[1])):
            raise ValueError(f"place {place} m: expected finite coordinates")
        column, row = self._column_row(*place)
        return min(max(row, 0), self.rows - 1) * self.columns + min(max(column, 0), self.columns - 1)

    def centroid(self, cell: int) -> Place:
        """Return the middle [m] of a cell."""
        x, y = self.centroids_m[cell]
        return float(x), float(y)

    def free(self, obstacles: Iterable[Polygon], platform_m: float) -> Mask:
        """Return which cells a platform of side `platform_m` can occupy, shape (rows * columns,).

        A platform may not protrude from the area either."""
        half = 0.5 * platform_m * (1.0 - TOUCHING)
        x, y = self.centroids_m.T
        free = np.asarray((x - half >= self.area.x_m[0]) & (x + half <= self.area.x_m[1])
                          & (y - half >= self.area.y_m[0]) & (y + half <= self.area.y_m[1]))
        for corners in obstacles:
            polygon = shapely.Polygon(corners)
            near = self._around(polygon.bounds, half)
            at_x, at_y = x[near], y[near]
            shapely.prepare(polygon)
            free[near] &= ~shapely.intersects(polygon, shapely.box(at_x - half, at_y - half, at_x + half, at_y + half))
        return free

    def _around(self, bounds: tuple[float, float, float, float], half_m: float) -> NDArray[np.intp]:
        """Return the cells, and one more on each side, whose platform can overlap a box (west, south, east, north)."""
        west, south, east, north = bounds
        first_column, first_row = self._column_row(west - half_m, south - half_m)
        last_column, last_row = self._column_row(east + half_m, north + half_m)
        columns = np.arange(max(first_column - 1, 0), min(last_column + 2, self.columns))
        rows = np.arange(max(first_row - 1, 0), min(last_row + 2, self.rows))
        return (rows[:, None] * self.columns + columns).ravel()

    def _column_row(self, x_m: float, y_m: float) -> tuple[int, int]:
        return int((x_m - self.area.x_m[0]) // self.side_m), int((y_m - self.area.y_m[0]) // self.side_m)


def square(centre: Place, side_m: float) -> Polygon:
    """Return the platform of another sensor as an obstacle: a square with sides along the axes."""
    (x, y), half = centre, 0.5 * side_m
    return (x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)
