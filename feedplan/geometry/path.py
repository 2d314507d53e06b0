"""A path: polynomial and rational Bézier pieces, grouped into runs between full stops."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from feedplan.curves.composite import CompositeCurve


@dataclass(frozen=True)
class FitSummary:
    """What fitting did: G1 `points` in, B-`splines` and `polynomials` out, `deviation` [mm] of the path.

    `points` are the G1 moves of the chains that were fitted, lines that stayed lines among them; each of
    those counts as a spline and a polynomial. `splines` and `polynomials` count what the fit made, before
    pieces are cut at changes of feed and at corners. `deviation` is a certified upper bound of the distance
    between the whole path (arcs and corners too) and the programmed one, both ways.
    """

    points: int = 0
    splines: int = 0
    polynomials: int = 0
    deviation: float = 0.0

    @property
    def spline_ratio(self) -> float:
        """Line segments approximated by one B-spline."""
        return self.points / self.splines if self.splines else 1.0

    @property
    def polynomial_ratio(self) -> float:
        """Line segments approximated by one polynomial."""
        return self.points / self.polynomials if self.polynomials else 1.0


@dataclass(frozen=True)
class Path:
    """Pieces C_i(u), u in [0, width_i], joined end to end.

    `axes` names; `curve` the n pieces [mm, deg], each of its own degree, polynomial or rational; `feed` (n,)
    commanded feed [mm/s], infinite on rapids; `move` (n, 2) first and last program move that the piece
    follows; `line` (n,) source line of the first; `runs` (r + 1,) piece offsets: the tool stands still at the
    start and the end of each run; `dwell` (r,) pause after each run [s]; `tolerance` (n,) allowed distance
    from the programmed path [mm]; `start_dwell` pause before the first run [s].
    `meaning` (r,) what the axes are on the machine in each run (`feedplan.machine.words.Meaning`) and
    `tool_length` (r,) [mm], NaN for the machine file's; None where the machine knows one meaning only.
    Within a run the tangent is continuous, unless corners are passed with a velocity jump.
    """

    axes: tuple[str, ...]
    curve: CompositeCurve
    feed: NDArray[np.float64]
    move: NDArray[np.int64]
    line: NDArray[np.int32]
    runs: NDArray[np.int64]
    dwell: NDArray[np.float64]
    tolerance: NDArray[np.float64]
    fit: FitSummary = field(default_factory=FitSummary)
    start_dwell: float = 0.0
    meaning: NDArray[np.uint8] | None = None
    tool_length: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        dtypes = {"feed": float, "move": np.int64, "line": np.int32, "runs": np.int64, "dwell": float}
        for name, dtype in {**dtypes, "tolerance": float}.items():
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=dtype))

    def __len__(self) -> int:
        return len(self.curve)

    @property
    def width(self) -> NDArray[np.float64]:
        """The parameter interval of each piece (n,) [mm: about the length]."""
        return self.curve.width

    def cut(self, curve: CompositeCurve, piece: NDArray[np.int64]) -> Path:
        """The same path with pieces cut: `curve` are the parts in order, `piece` (m,) what they are of."""
        return replace(
            self,
            curve=curve,
            feed=self.feed[piece],
            move=self.move[piece],
            line=self.line[piece],
            runs=np.searchsorted(piece, self.runs),
            tolerance=self.tolerance[piece],
        )

    @property
    def pauses(self) -> float:
        """Time of all pauses, before the first run and after each [s]."""
        return self.start_dwell + math.fsum(self.dwell)
