"""The planning problem of one subrun as a program in p at the stations of a mesh, with rows for its cells.

In a cell in which joint k keeps its direction, the mean of its acceleration a_k over its displacement Δq_k is
exactly

    (q'_k(end)² p_end − q'_k(start)² p_start) / (2 Δq_k),

which is linear in p, and equals a_k if a_k is constant in the cell. Limiting this mean is accurate to second
order in the width of the cells. Limiting a_k at both ends of a cell, with p linear in between, is accurate
only to first order; it is used only where a joint reverses inside the cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.lazy import cached_property
from feedplan.planners._mesh import Mesh

# A joint slower than this share of the norm of all joints' speeds gets rows at both ends: its displacement
# may be rounding.
_SLOW = 1e-6


@dataclass(frozen=True)
class Rows:
    """Rows (r,) −`low` ≤ `near`·p_start + `far`·p_end ≤ 1, with p at the start and end of `cell`.

    `held` (n, joints): whether the limit of a joint is imposed at both ends of the cell, which loses an order
    of accuracy.
    """

    cell: Integers
    near: Floats
    far: Floats
    low: Floats
    held: Flags


@dataclass(frozen=True)
class Transcription:
    """Minimise Σ 2 width/(√p_start + √p_end) over the cells, with p = `scale`·x at the stations (n + 1,).

    x is about 1 where p is greatest. `most` is the greatest x allowed, `fixed` the given x at both ends of
    the subrun, or None. For each cell: `near` and `far` are √p_start/√x_start and √p_end/√x_end, `width` is
    its width. `rows` are in x.
    """

    scale: Floats
    most: Floats
    fixed: tuple[float | None, float | None]
    width: Floats
    near: Floats
    far: Floats
    rows: Rows

    @property
    def cells(self) -> int:
        """Number of cells n."""
        return len(self.width)

    @cached_property
    def free(self) -> Flags:
        """Whether the solver has to find x at each station (n + 1,)."""
        free = np.ones(self.cells + 1, dtype=bool)
        free[[0, -1]] = [x is None for x in self.fixed]
        return free

    @cached_property
    def known(self) -> Floats:
        """x at the stations where it is given, 0 elsewhere (n + 1,)."""
        known = np.zeros(self.cells + 1)
        for station, x in zip((0, -1), self.fixed, strict=True):
            known[station] = x or 0.0
        return known

    def completed(self, found: Floats) -> Floats:
        """x at all stations (n + 1,) from x at the free ones."""
        x = self.known.copy()
        x[self.free] = found
        return x


def transcribe(
    mesh: Mesh, rows: Rows, acceleration: Floats, share: Floats, feasible: bool = True
) -> Transcription:
    """The problem on a mesh; `acceleration` (2, joints) are the limits in negative and positive direction as
    absolute values, `share` (n + 1,) is the allowed share of the greatest p at the stations.

    If `feasible`, p at each station is at most the limit curve on both sides: the greatest p that some
    acceleration of the parameter allows.
    """
    limit = np.append(_limit_curve(mesh, acceleration, 0)[:1], _limit_curve(mesh, acceleration, -1))
    limit[:-1] = np.minimum(limit[:-1], _limit_curve(mesh, acceleration, 0) / mesh.gain)
    scale = _reachable(mesh, rows, np.minimum(limit, mesh.cap))
    # Where no limit holds, because all joints rest, and where p is 0, the scale is interpolated from the
    # neighbours.
    endless = ~(np.isfinite(scale) & (scale > 0.0))
    if endless.any():
        where = np.flatnonzero(~endless)
        scale[endless] = np.interp(np.flatnonzero(endless), where, scale[where]) if len(where) else 1.0
    near, far = mesh.gain * scale[:-1], scale[1:]
    ends = zip(mesh.fixed, scale[[0, -1]].tolist(), strict=True)
    fixed = [None if p is None else p / unit for p, unit in ends]
    return Transcription(
        scale=scale,
        most=share * (np.minimum(limit, mesh.cap) if feasible else mesh.cap) / scale,
        fixed=(fixed[0], fixed[1]),
        width=mesh.width,
        near=np.sqrt(near),
        far=np.sqrt(far),
        rows=replace(rows, near=rows.near * near[rows.cell], far=rows.far * far[rows.cell]),
    )


def _reachable(mesh: Mesh, rows: Rows, greatest: Floats) -> Floats:
    """The greatest p at the stations that the rows allow, by one pass from each end of the subrun (n + 1,).

    A row with coefficients of opposite signs limits the growth of p from station to station, as near a stop.
    """
    bounds = np.flatnonzero((rows.near * rows.far <= 0.0) & (rows.near != 0.0) & (rows.far != 0.0))
    bounds = bounds[np.argsort(rows.cell[bounds], kind="stable")]
    first = np.searchsorted(rows.cell[bounds], np.arange(len(mesh) + 1)).tolist()
    near = np.abs(rows.near[bounds] * mesh.gain[rows.cell[bounds]]).tolist()
    far = np.abs(rows.far[bounds]).tolist()
    # The right-hand sides of a row for growing p, and for falling p.
    low = rows.low[bounds]
    rise = np.where(rows.far[bounds] > 0.0, 1.0, low).tolist()
    fall = np.where(rows.near[bounds] > 0.0, 1.0, low).tolist()
    p = greatest.tolist()
    for end, known in zip((0, -1), mesh.fixed, strict=True):
        p[end] = p[end] if known is None else known
    for cell in range(len(mesh)):
        reach = [(rise[i] + near[i] * p[cell]) / far[i] for i in range(first[cell], first[cell + 1])]
        p[cell + 1] = min([p[cell + 1], *reach])
    for cell in reversed(range(len(mesh))):
        reach = [(fall[i] + far[i] * p[cell + 1]) / near[i] for i in range(first[cell], first[cell + 1])]
        p[cell] = min([p[cell], *reach])
    return np.array(p)


def mean_rows(mesh: Mesh, limit: Floats, at_ends: Flags) -> Rows:
    """Rows that keep the mean acceleration of every joint over its displacement within −`limit[0]` and
    `limit[1]` (2, n, joints) [mm/s²].

    In the cells `at_ends` (n,), and where a joint does not keep its direction, the acceleration at both ends
    is limited instead.
    """
    size = np.linalg.norm(mesh.slope, axis=2).max(axis=0)
    sign = np.sign(mesh.way[-1])
    steady = (mesh.slope * sign >= 0.0).all(axis=0) & (np.abs(mesh.slope).max(axis=0) > _SLOW * size[:, None])
    steady &= ~at_ends[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = 1.0 / (2.0 * mesh.way[-1] * limit[1])
        near, far = -(mesh.slope[0] ** 2) * weight, mesh.slope[-1] ** 2 * weight
    cell, joint = np.nonzero(steady)
    moves = (mesh.slope != 0.0).any(axis=0)
    rest = end_rows(mesh, limit, ~steady & moves)
    return Rows(
        np.concatenate([cell, rest.cell]),
        np.concatenate([near[cell, joint], rest.near]),
        np.concatenate([far[cell, joint], rest.far]),
        np.concatenate([(limit[0] / limit[1])[cell, joint], rest.low]),
        rest.held,
    )


def end_rows(mesh: Mesh, limit: Floats, chosen: Flags | None = None, ends: tuple[int, ...] = (0, -1)) -> Rows:
    """Rows that keep a_k at the `ends` of the cells, with p linear in between, within −`limit[0]` and
    `limit[1]` (2, n, joints), for the `chosen` joints (n, joints), by default all."""
    if chosen is None:
        chosen = np.ones(limit.shape[1:], dtype=bool)
    cell, joint = np.nonzero(chosen)
    weight = 1.0 / limit[1, cell, joint]
    low = limit[0, cell, joint] * weight
    near, far = [], []
    for end in ends:
        slope = mesh.slope[end, cell, joint] * weight / (2.0 * mesh.width[cell])
        bend = mesh.bend[end, cell, joint] * weight
        near.append(-slope + (bend if end == 0 else 0.0))
        far.append(slope + (bend if end == -1 else 0.0))
    return Rows(
        np.tile(cell, len(ends)), np.concatenate(near), np.concatenate(far), np.tile(low, len(ends)), chosen
    )


def _limit_curve(mesh: Mesh, acceleration: Floats, place: int) -> Floats:
    """The limit curve at one place of the cells (n,): the greatest p for which some acceleration of the
    parameter keeps all limits."""
    bend, tangent = mesh.bend[place], mesh.slope[place]
    best = np.full(len(mesh), np.inf)

    def most(k: int, factor: Floats) -> Floats:
        """The greatest value of a_k·factor within the limits of joint k."""
        return np.asarray(np.where(factor < 0.0, acceleration[0, k], acceleration[1, k]) * np.abs(factor))

    with np.errstate(divide="ignore", invalid="ignore"):
        for j in range(acceleration.shape[1]):
            alone = most(j, np.sign(bend[:, j])) / np.abs(bend[:, j])
            best = np.fmin(best, np.where(tangent[:, j] == 0.0, alone, np.inf))
            for k in range(j):
                # Eliminating the parameter's acceleration s gives turn · p = a_j q'_k − a_k q'_j.
                turn = bend[:, j] * tangent[:, k] - bend[:, k] * tangent[:, j]
                room = most(j, np.sign(turn) * tangent[:, k]) + most(k, -np.sign(turn) * tangent[:, j])
                best = np.fmin(best, np.where(turn != 0.0, room / np.abs(turn), np.inf))
    return best
