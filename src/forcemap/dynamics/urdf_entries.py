"""The links and joints of a URDF, one by one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.dynamics.rigid_body import NOTHING, Body, Frame, cross_matrix, moved_body
from forcemap.dynamics.robot import JointKind
from forcemap.dynamics.xml_tree import Element
from forcemap.errors import InputError

_FIXED = "fixed"
_KINDS = (_FIXED, *JointKind)
_LARGEST = 1e9  # far above any robot; products of such numbers stay finite


@dataclass(frozen=True, eq=False)
class JointEntry:
    """A joint of the file, between two links; kind is None where it is fixed."""

    name: str
    kind: JointKind | None
    parent: str
    child: str
    origin: Frame
    axis: FloatArray
    lower: float
    upper: float
    mimics: bool
    line: int

    def held(self) -> Frame:
        """Frame of the child in the parent, the joint as near to zero as its limits allow."""
        position = min(max(0.0, self.lower), self.upper)
        if self.kind is None:
            return self.origin
        if self.kind is JointKind.PRISMATIC:
            return self.origin.then(Frame(self.axis * position, np.eye(3)))
        k = cross_matrix(self.axis)
        return self.origin.then(
            Frame(np.zeros(3), np.eye(3) + math.sin(position) * k + (1 - math.cos(position)) * k @ k)
        )


def named_elements(elements: Iterable[Element], file: str) -> dict[str, Element]:
    """Elements by name.

    Raises
    ------
    InputError
        One has no name, or two have the same.
    """
    found: dict[str, Element] = {}
    for element in elements:
        name = _attribute(element, "name", file)
        if name in found:
            raise _refused(f"a second {element.tag} is named {name!r}, expected a name of its own", element, file)
        found[name] = element
    return found


def link_body(link: Element, file: str) -> Body:
    """Body of a link, in the frame of the link.

    Raises
    ------
    InputError
        Figures that are missing, no numbers, or impossible.
    """
    inertial = link.first("inertial")
    if inertial is None:
        return NOTHING
    mass, inertia = _inside(inertial, "mass", file), _inside(inertial, "inertia", file)
    i = {key: _number(inertia, key, file) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    matrix = [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
    try:
        body = Body.of(_number(mass, "value", file), np.zeros(3), matrix)
    except InputError as error:
        raise _refused(f"link {link.attributes['name']!r}: {error.message}", inertial, file) from None
    return moved_body(body, _origin(inertial, file))


def joint_entry(joint: Element, links: Iterable[str], file: str) -> JointEntry:
    """A joint.

    Raises
    ------
    InputError
        A kind that is not supported, a link that does not exist, an axis without length, limits that are missing or
        the wrong way round.
    """
    name, kind = joint.attributes["name"], _attribute(joint, "type", file)
    if kind not in _KINDS:
        raise _refused(f"joint {name!r}: found the type {kind!r}, expected one of {', '.join(_KINDS)}", joint, file)
    ends = {}
    for end in ("parent", "child"):
        element = _inside(joint, end, file)
        ends[end] = _attribute(element, "link", file)
        if ends[end] not in links:
            raise _refused(f"joint {name!r}: there is no link named {ends[end]!r}, its {end}", element, file)
    lower, upper = _limits(joint, kind, file)
    return JointEntry(
        name=name,
        kind=None if kind == _FIXED else JointKind(kind),
        **ends,
        origin=_origin(joint, file),
        axis=_axis(joint, file) if kind != _FIXED else np.array([1.0, 0.0, 0.0]),
        lower=lower,
        upper=upper,
        mimics=joint.first("mimic") is not None,
        line=joint.line,
    )


def _axis(joint: Element, file: str) -> FloatArray:
    element = joint.first("axis")
    axis = np.array([1.0, 0.0, 0.0]) if element is None else np.array(_three(element, "xyz", file))
    length = np.linalg.norm(axis)
    if not 1e-9 < length < math.inf:
        raise _refused(
            f"joint {joint.attributes['name']!r}: found an axis of length {length:g}, expected 1", joint, file
        )
    return np.asarray(axis / length)


def _limits(joint: Element, kind: str, file: str) -> tuple[float, float]:
    if kind == _FIXED:
        return 0.0, 0.0
    if kind == JointKind.CONTINUOUS:
        return -math.inf, math.inf
    limit = _inside(joint, "limit", file)
    lower, upper = (_number(limit, key, file) if key in limit.attributes else 0.0 for key in ("lower", "upper"))
    if lower >= upper:
        name = joint.attributes["name"]
        raise _refused(f"joint {name!r}: found limits from {lower:g} to {upper:g}, expected lower < upper", limit, file)
    return lower, upper


def _origin(element: Element, file: str) -> Frame:
    origin = element.first("origin")
    if origin is None:
        return Frame.of()
    xyz, rpy = (_three(origin, key, file) if key in origin.attributes else [0.0] * 3 for key in ("xyz", "rpy"))
    return Frame.of(xyz, rpy)


def _three(element: Element, key: str, file: str) -> list[float]:
    text = _attribute(element, key, file)
    numbers = [_finite(part) for part in text.split()]
    if len(numbers) != 3 or None in numbers:
        raise _refused(f"<{element.tag} {key}>: found {text!r}, expected three finite numbers", element, file)
    return [number for number in numbers if number is not None]


def _number(element: Element, key: str, file: str) -> float:
    text = _attribute(element, key, file)
    number = _finite(text)
    if number is None:
        raise _refused(f"<{element.tag} {key}>: found {text!r}, expected a finite number", element, file)
    return number


def _finite(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if abs(number) <= _LARGEST and "_" not in text else None


def _inside(element: Element, tag: str, file: str) -> Element:
    found = element.first(tag)
    if found is None:
        name = f" {element.attributes['name']!r}" if "name" in element.attributes else ""
        raise _refused(f"{element.tag}{name} has no <{tag}>, expected one", element, file)
    return found


def _attribute(element: Element, key: str, file: str) -> str:
    value = element.attributes.get(key, "").strip()
    if not value:
        raise _refused(f'<{element.tag}> has no {key}, expected {key}="..."', element, file)
    return value


def _refused(message: str, element: Element, file: str) -> InputError:
    return InputError(message, file=file, row=element.line)
