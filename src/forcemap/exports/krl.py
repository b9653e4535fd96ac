"""A KUKA KRL data list with the zones, and a function that looks a speed up in it."""

from __future__ import annotations

from forcemap.exports.head import head_comment
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
    return "\n".join(["DEF FORCEMAP()", *head_comment(table.provenance, ";"), "END", "", function])
