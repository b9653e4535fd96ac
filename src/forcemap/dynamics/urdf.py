"""Robots from a URDF of the user's."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from forcemap.dynamics.rigid_body import NOTHING, Body, Frame, moved_body, united
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.dynamics.xml_tree import Element, read_xml
from forcemap.errors import InputError, UnknownName

_MOST_LINKS = 500


def read_urdf(path: str | Path, *, base: str | None = None, tip: str | None = None) -> Robot:
    """Read a robot from a URDF: fixed, revolute, continuous and prismatic joints, masses and inertias.

    Meshes, materials and controllers are not read. A link without <inertial> has no mass, as the format says. Joints
    that do not lie between base and tip, such as the fingers of a gripper, are held where they are nearest to zero;
    what they carry is carried along, and `Robot.held_joints` names them.

    Parameters
    ----------
    path : str or Path
        The file; a xacro file becomes a URDF by running xacro on it.
    base : str, optional
        Link whose frame distances and heights refer to; if not given, the root.
    tip : str, optional
        Link whose frame is the flange, its z axis the direction of the tool; if not given, the only end of the tree.

    Raises
    ------
    InputError
        The file cannot be read, or does not describe a tree of links with possible inertias and limits.
    UnknownName
        No link is named as base or tip says.
    """
    file, root = Path(path).name, read_xml(path)
    if root.tag != "robot":
        raise root.refused(f"found <{root.tag}>, expected <robot>: a URDF")
    if any(child.tag.startswith("xacro:") for child in root.children):
        raise root.refused("this is a xacro file, expected a URDF; run xacro on it first")
    links = {name: _link_body(link) for name, link in _named(root.all("link")).items()}
    tree = _LinkTree(file, links, [_link_joint(*each, links) for each in _named(root.all("joint")).items()])
    chain = tree.chain(base, tip)
    frame, joints, held = Frame.of(), list[Joint](), list[str]()
    for each in chain:  # fixed joints become part of the origins and bodies of those that move
        frame = frame.then(each.origin)
        if each.moving is not None:
            joints.append(replace(each.moving, origin=frame))
            frame = Frame.of()
        if joints:  # what stands before the first of them does not move
            body, beside = tree.carried(each.child, chain)
            joints[-1] = joints[-1].with_body(body, frame)
            held += beside
    if not any(joint.body.mass > 0 for joint in joints):
        raise InputError("no link that moves has a mass, expected <inertial> elements", file=file)
    middle = [0.0 if math.isinf(joint.lower) else (joint.lower + joint.upper) / 2 for joint in joints]
    return Robot(
        name=root.attributes.get("name") or file,
        source=f"{file}, from {chain[0].parent!r} to {chain[-1].child!r}",
        joints=tuple(joints),
        flange=frame,
        reference_posture=np.array(middle),
        held_joints=tuple(held),
    )


def _named(elements: Iterable[Element]) -> dict[str, Element]:
    """Elements by name, which has to be there, and its own."""
    named: dict[str, Element] = {}
    for element in elements:
        if named.setdefault(name := element.text("name"), element) is not element:
            raise element.refused(f"a second {element.tag} is named {name!r}, expected a name of its own")
    return named


def _link_body(link: Element) -> Body:
    """Body of a link, in the frame of the link."""
    inertial = link.first("inertial")
    if inertial is None:
        return NOTHING
    (mass,), inertia = inertial.inside("mass").numbers("value"), inertial.inside("inertia")
    matrix = [[inertia.numbers(f"i{min(a, b)}{max(a, b)}")[0] for b in "xyz"] for a in "xyz"]
    try:
        return moved_body(Body.of(mass, np.zeros(3), matrix), _origin(inertial))
    except InputError as error:
        raise inertial.refused(f"link {link.attributes['name']!r}: {error.message}") from None


def _link_joint(name: str, joint: Element, links: Iterable[str]) -> _LinkJoint:
    kind, origin = joint.text("type"), _origin(joint)
    if kind not in (kinds := ("fixed", *JointKind)):
        raise joint.refused(f"joint {name!r}: found the type {kind!r}, expected one of {', '.join(kinds)}")
    ends = {end: joint.inside(end).text("link") for end in ("parent", "child")}
    for end, link in ends.items():
        if link not in links:
            raise joint.inside(end).refused(f"joint {name!r}: there is no link named {link!r}, its {end}")
    moving = None if kind == "fixed" else _moving(name, joint, JointKind(kind), origin)
    return _LinkJoint(joint, name, **ends, origin=origin, moving=moving)


def _moving(name: str, joint: Element, kind: JointKind, origin: Frame) -> Joint:
    element = joint.first("axis")
    axis = np.array([1.0, 0.0, 0.0] if element is None else element.numbers("xyz", 3))
    length = np.linalg.norm(axis)
    if not 1e-9 < length < math.inf:
        raise joint.refused(f"joint {name!r}: found an axis of length {length:g}, expected 1")
    lower, upper = -math.inf, math.inf
    if kind is not JointKind.CONTINUOUS:
        limit = joint.inside("limit")
        lower, upper = (limit.numbers(key)[0] if key in limit.attributes else 0.0 for key in ("lower", "upper"))
        if lower >= upper:
            raise limit.refused(f"joint {name!r}: found limits from {lower:g} to {upper:g}, expected lower < upper")
    return Joint(name, kind, origin, axis / length, lower, upper, NOTHING)


def _origin(element: Element) -> Frame:
    if (origin := element.first("origin")) is None:
        return Frame.of()
    return Frame.of(**{key: origin.numbers(key, 3) for key in ("xyz", "rpy") if key in origin.attributes})


@dataclass(frozen=True, eq=False)
class _LinkJoint:
    """A joint of the file, between two links; `moving` is None where it is fixed."""

    element: Element
    name: str
    parent: str
    child: str
    origin: Frame
    moving: Joint | None


@dataclass(frozen=True, eq=False)
class _LinkTree:
    """Links and the joints between them.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    links : dict of str to Body
        Bodies by the name of the link.
    joints : list of _LinkJoint
        The joints.
    carrying : dict of str to _LinkJoint
        The joint by the name of the link that hangs on it.

    Raises
    ------
    InputError
        No tree: no link, several roots, a link with two parents, or a loop.
    """

    file: str
    links: dict[str, Body]
    joints: list[_LinkJoint]
    carrying: dict[str, _LinkJoint] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 < len(self.links) <= _MOST_LINKS:
            raise self._refused(f"found {len(self.links)} links, expected 1 to {_MOST_LINKS}")
        for joint in self.joints:
            if (other := self.carrying.setdefault(joint.child, joint)) is not joint:
                raise joint.element.refused(
                    f"the joints {other.name!r} and {joint.name!r} both carry the link {joint.child!r}, expected one"
                )
        roots = [name for name in self.links if name not in self.carrying]
        if len(roots) > 1:
            raise self._refused(f"the links {_listed(roots)} hang on nothing, expected one root for all links")
        reached = set(roots)
        while grown := {joint.child for joint in self.joints if joint.parent in reached} - reached:
            reached |= grown
        if loop := [name for name in self.links if name not in reached]:
            raise self._refused(f"the links {_listed(loop)} form a loop, expected a tree")

    def chain(self, base: str | None, tip: str | None) -> list[_LinkJoint]:
        """Joints from the base, if not given the root, to the tip, if not given the only link on which nothing hangs.

        Raises
        ------
        UnknownName
            No link is named so.
        InputError
            No tip is given and there are several ends, the tip does not hang on the base, no joint moves between them,
            or one mimics another.
        """
        parents = {joint.parent for joint in self.joints}
        ends = [name for name in self.links if name not in parents]
        if tip is None and len(ends) > 1:
            listed = _listed(ends)
            raise self._refused(f"the robot ends in the links {listed}; name the one that is the flange as the tip")
        first = next(name for name in self.links if name not in self.carrying) if base is None else base
        last = link = ends[0] if tip is None else tip
        for name in (first, last):
            if name not in self.links:
                raise UnknownName(f"link of {self.file}", name, self.links)
        chain: list[_LinkJoint] = []
        while link != first:
            if link not in self.carrying:
                raise self._refused(f"the link {last!r} does not hang on {first!r}; name another base or tip")
            chain.insert(0, self.carrying[link])
            link = chain[0].parent
        if all(joint.moving is None for joint in chain):
            raise self._refused(f"no joint moves between {first!r} and {last!r}, expected at least one")
        for joint in chain:
            if joint.element.first("mimic"):
                raise joint.element.refused(f"joint {joint.name!r} mimics another, expected free joints up to the tip")
        return chain

    def carried(self, link: str, chain: list[_LinkJoint]) -> tuple[Body, list[str]]:
        """Body of a link with all that hangs on it beside the chain, and the names of the joints held for it."""
        bodies, held = [self.links[link]], []
        for joint in self.joints:
            if joint.parent == link and joint not in chain:
                body, inner = self.carried(joint.child, chain)
                bodies.append(moved_body(body, joint.moving.held() if joint.moving else joint.origin))
                held += [joint.name] * (joint.moving is not None) + inner
        return united(bodies), held

    def _refused(self, message: str) -> InputError:
        return InputError(message, file=self.file)


def _listed(names: list[str]) -> str:
    return ", ".join(map(repr, names[:6])) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
