"""KUKA KRL: a data list with the zones, and the function that looks a speed up in it, for a place or a motion."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from forcemap.exports.directed_tables import DirectedTables
from forcemap.exports.head import comment_lines, head_comment, way_spacing
from forcemap.exports.robot_table import RobotTable

_FUNCTION = """\
GLOBAL DEFFCT REAL FORCEMAP_SPEED(P:IN)
; allowed speed of the contact point [m/s] for its place in ROBROOT [mm]; 0.0 is no permission
DECL FRAME P
DECL REAL D, H, V
DECL INT I, J
V = 0.0
D = SQRT(P.X*P.X + P.Y*P.Y)
H = P.Z
IF (D >= FM_D[1]) AND (D <= FM_D[{n}]) AND (H >= FM_H[1]) AND (H <= FM_H[{m}]) THEN
  I = 1
  WHILE (I < {last_i}) AND (D >= FM_D[I+1])
    I = I + 1
  ENDWHILE
  J = 1
  WHILE (J < {last_j}) AND (H >= FM_H[J+1])
    J = J + 1
  ENDWHILE
  V = FM_V[I,J]
ENDIF
RETURN V
ENDFCT
"""

_USE = """\
how to ask it: $TOOL is the contact site, $BASE is $ROBROOT, the motion (LIN) is straight and in the map's direction;
take the least along the whole way from HERE to TARGET (E6POS), asked every {spacing:g} mm, never the speed at one end;
on 0.0 do not move (docs/kuka.md); P is a FRAME, the others are REAL
  P = $NULLFRAME
  P.X = TARGET.X - HERE.X
  P.Y = TARGET.Y - HERE.Y
  P.Z = TARGET.Z - HERE.Z
  L = SQRT(P.X*P.X + P.Y*P.Y + P.Z*P.Z)
  V = FORCEMAP_SPEED(TARGET)
  S = 0.0
  WHILE S < 1.0
    P.X = HERE.X + S*(TARGET.X-HERE.X)
    P.Y = HERE.Y + S*(TARGET.Y-HERE.Y)
    P.Z = HERE.Z + S*(TARGET.Z-HERE.Z)
    W = FORCEMAP_SPEED(P)
    IF W < V THEN
      V = W
    ENDIF
    S = S + {spacing:.3f}/(L + {spacing:.3f})
  ENDWHILE
  if V > 0.0, and only then: $VEL.CP = V and LIN TARGET
"""

_USE_ALONG = """\
how to ask it: $TOOL is the point whose motion the maps are of, $BASE is $ROBROOT; one question holds for the whole
straight way (LIN) from HERE to TARGET (E6POS); on 0.0 do not move (docs/kuka.md, docs/atlas.md)
  V = FORCEMAP_ALONG(HERE, TARGET, {tool})
  if V > 0.0, and only then: $VEL.CP = V and LIN TARGET
"""

_ALONG = """\
GLOBAL DEFFCT REAL FORCEMAP_ALONG(P:IN, Q:IN, TOOL:IN)
; allowed speed of the contact point [m/s] on the straight way between two places in ROBROOT [mm], with a tool by its
; number in the head; 0.0 is no permission
DECL FRAME P, Q
DECL INT TOOL
DECL REAL X, Y, Z, L, PX, PY, QX, QY, DP, DQ, NEAR, FAR, LOW, HIGH
DECL REAL SHARE, ASIDE, ALONG, LEAST, BESIDE, COSINE, V, OFSITE, ALLOWED
DECL INT T, S, K, I, J, COLS
X = Q.X - P.X
Y = Q.Y - P.Y
Z = Q.Z - P.Z
L = SQRT(X*X + Y*Y + Z*Z)
ALLOWED = 0.0
IF L > 0.001 THEN
  T = 1
  WHILE T <= {count}
    IF FM_CODE[T] == TOOL THEN
      ALLOWED = 9.0
      S = 1
      WHILE S <= {sites}
        IF FM_NEED[T,S] > 0 THEN
          PX = P.X + FM_AT[S,1]
          PY = P.Y + FM_AT[S,2]
          QX = Q.X + FM_AT[S,1]
          QY = Q.Y + FM_AT[S,2]
          DP = SQRT(PX*PX + PY*PY)
          DQ = SQRT(QX*QX + QY*QY)
          NEAR = DP
          FAR = DP
          IF DQ < NEAR THEN
            NEAR = DQ
          ENDIF
          IF DQ > FAR THEN
            FAR = DQ
          ENDIF
          IF X*X + Y*Y > 0.0 THEN
            SHARE = (0.0 - PX*X - PY*Y) / (X*X + Y*Y)
            IF (SHARE > 0.0) AND (SHARE < 1.0) THEN
              ALONG = PX + SHARE*X
              ASIDE = PY + SHARE*Y
              NEAR = SQRT(ALONG*ALONG + ASIDE*ASIDE)
            ENDIF
          ENDIF
          LOW = P.Z + FM_AT[S,3]
          HIGH = LOW
          IF Q.Z + FM_AT[S,3] < LOW THEN
            LOW = Q.Z + FM_AT[S,3]
          ENDIF
          IF Q.Z + FM_AT[S,3] > HIGH THEN
            HIGH = Q.Z + FM_AT[S,3]
          ENDIF
          OFSITE = 0.0
          K = 1
          WHILE K <= {tables}
            IF (FM_TOOL[K] == T) AND (FM_SITE[K] == S) AND (NEAR > {closest}) THEN
              ; the motion must point along the table's direction at both ends, wherever beside it the robot is
              COSINE = {cosine}
              IF FM_LEVEL[K] > 0.0 THEN
                BESIDE = {tolerance} / NEAR
                COSINE = {cosine} * SQRT(1.0 - BESIDE*BESIDE) + {sine} * BESIDE
              ENDIF
              ALONG = FM_U[K,1] * PX - FM_U[K,2] * PY
              ASIDE = FM_U[K,1] * PY + FM_U[K,2] * PX
              LEAST = (X*ALONG + Y*ASIDE) / DP
              ALONG = FM_U[K,1] * QX - FM_U[K,2] * QY
              ASIDE = FM_U[K,1] * QY + FM_U[K,2] * QX
              ALONG = (X*ALONG + Y*ASIDE) / DQ
              IF ALONG < LEAST THEN
                LEAST = ALONG
              ENDIF
              IF (LEAST >= 0.0) AND (LEAST + Z * FM_U[K,3] >= COSINE * L) THEN
                V = 9.0
                COLS = FM_H1[K+1] - FM_H1[K] - 1
                IF NEAR < FM_D[FM_D1[K]] THEN
                  V = 0.0
                ENDIF
                IF FAR > FM_D[FM_D1[K+1]-1] THEN
                  V = 0.0
                ENDIF
                IF LOW < FM_H[FM_H1[K]] THEN
                  V = 0.0
                ENDIF
                IF HIGH > FM_H[FM_H1[K+1]-1] THEN
                  V = 0.0
                ENDIF
                I = FM_D1[K]
                WHILE I < FM_D1[K+1] - 1
                  IF (FM_D[I] <= FAR) AND (FM_D[I+1] >= NEAR) THEN
                    J = FM_H1[K]
                    WHILE J < FM_H1[K+1] - 1
                      IF (FM_H[J] <= HIGH) AND (FM_H[J+1] >= LOW) THEN
                        IF FM_V[FM_V1[K] + (I - FM_D1[K]) * COLS + J - FM_H1[K]] < V THEN
                          V = FM_V[FM_V1[K] + (I - FM_D1[K]) * COLS + J - FM_H1[K]]
                        ENDIF
                      ENDIF
                      J = J + 1
                    ENDWHILE
                  ENDIF
                  I = I + 1
                ENDWHILE
                OFSITE = V
              ENDIF
            ENDIF
            K = K + 1
          ENDWHILE
          IF OFSITE < ALLOWED THEN
            ALLOWED = OFSITE
          ENDIF
        ENDIF
        S = S + 1
      ENDWHILE
    ENDIF
    T = T + 1
  ENDWHILE
ENDIF
IF ALLOWED > 8.0 THEN
  ALLOWED = 0.0
ENDIF
RETURN ALLOWED
ENDFCT
"""


def krl_along_data(tables: DirectedTables) -> str:
    """The text of FORCEMAP.DAT for motions: directions, what each table is of, edges [mm] and speeds [m/s]."""
    zones, numbers = [each.table for each in tables.tables], [tables.numbers(each) for each in tables.tables]
    vectors = np.array([each.campaign.direction for each in tables.tables])
    edges = [(table.distance_edges, table.height_edges) for table in zones]
    reals = {
        "FM_LEVEL": np.hypot(*vectors.T[:2]),
        "FM_D": np.round(1000 * np.concatenate([d for d, _ in edges]), 1),
        "FM_H": np.round(1000 * np.concatenate([h for _, h in edges]), 1),
        "FM_V": np.concatenate([table.speed_mmps.ravel() for table in zones]) / 1000,
    }
    whole = {
        "FM_SITE": [site for site, _ in numbers],
        "FM_TOOL": [tool for _, tool in numbers],
        "FM_D1": _starts([d.size for d, _ in edges]),
        "FM_H1": _starts([h.size for _, h in edges]),
        "FM_V1": _starts([table.speed_mmps.size for table in zones]),
    }
    lines = ["DEFDAT FORCEMAP PUBLIC", *comment_lines(tables.lines, ";")]
    lines += _table("REAL", "FM_U", vectors.tolist())
    lines += _table("INT", "FM_NEED", tables.needed)
    lines += _array("INT", "FM_CODE", tables.codes)
    lines += _table("REAL", "FM_AT", [(1000 * offset).tolist() for offset in tables.offsets])
    for name, values in reals.items():
        lines += _array("REAL", name, values.tolist())
    for name, counts in whole.items():
        lines += _array("INT", name, counts)
    return "\n".join([*lines, "ENDDAT", ""])


def krl_along_source(tables: DirectedTables) -> str:
    """The text of FORCEMAP.SRC for motions: the function FORCEMAP_ALONG.

    It holds for straight motions (LIN) from one place to another; what else it gives 0.0 for is that of
    `urscript_along`.
    """
    cosine, sine = tables.cosine_and_sine
    function = _ALONG.format(
        closest=f"{1000 * tables.closest:.3f}",
        tolerance=f"{1000 * tables.provenance.allowance.position:.3f}",
        cosine=f"{cosine:.9f}",
        sine=f"{sine:.9f}",
        sites=len(tables.sites),
        count=len(tables.tools),
        tables=len(tables.tables),
    )
    use = _USE_ALONG.format(tool=tables.codes[0]).splitlines()
    return "\n".join(["DEF FORCEMAP()", *comment_lines([*tables.lines, *use], ";"), "END", "", function])


def _array(kind: str, name: str, values: Sequence[float]) -> list[str]:
    lines = [f"DECL GLOBAL {kind} {name}[{len(values)}]"]
    return lines + [f"{name}[{i}]={_number(value)}" for i, value in enumerate(values, start=1)]


def _table(kind: str, name: str, rows: Sequence[Sequence[float]]) -> list[str]:
    lines = [f"DECL GLOBAL {kind} {name}[{len(rows)},{len(rows[0])}]"]
    cells = ((i, j, value) for i, row in enumerate(rows, start=1) for j, value in enumerate(row, start=1))
    return lines + [f"{name}[{i},{j}]={_number(value)}" for i, j, value in cells]


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value + 0.0:.9f}".rstrip("0") + "0"


def _starts(sizes: Iterable[int]) -> list[int]:
    """Where each part of a list begins, counted from 1, and where one after the last would."""
    return [1, *(1 + total for total in itertools.accumulate(sizes))]


def krl_data(table: RobotTable) -> str:
    """The text of FORCEMAP.DAT: edges of the zones [mm] and speeds [m/s], counted from 1."""
    rows, columns = table.speed_mmps.shape
    edges = {"FM_D": table.distance_edges, "FM_H": table.height_edges}
    lines = ["DEFDAT FORCEMAP PUBLIC", *head_comment(table.provenance, ";")]
    for name, values in edges.items():
        lines.append(f"DECL GLOBAL REAL {name}[{values.size}]")
        lines += [f"{name}[{i}]={1000 * value:.1f}" for i, value in enumerate(values.tolist(), start=1)]
    lines.append(f"DECL GLOBAL REAL FM_V[{rows},{columns}]")
    lines += [f"FM_V[{i + 1},{j + 1}]={table.speed_mmps[i, j] / 1000:.3f}" for i in range(rows) for j in range(columns)]
    return "\n".join([*lines, "ENDDAT", ""])


def krl_source(table: RobotTable) -> str:
    """The text of FORCEMAP.SRC: the function FORCEMAP_SPEED."""
    rows, columns = table.speed_mmps.shape
    function = _FUNCTION.format(n=rows + 1, m=columns + 1, last_i=rows, last_j=columns)
    use = comment_lines(_USE.format(spacing=1000 * way_spacing(table.provenance)).splitlines(), ";")
    return "\n".join(["DEF FORCEMAP()", *head_comment(table.provenance, ";"), *use, "END", "", function])
