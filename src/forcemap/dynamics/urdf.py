"""Robots from a URDF of the user's."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from forcemap.dynamics.rigid_body import NOTHING, Body, Frame, moved_body, united
from forcemap.dynamics.robot import Joint, JointKind, Robot
from forcemap.dynamics.urdf_units import joint_limits, origin_length, refuse_body, refuse_masses, refuse_turns
from forcemap.dynamics.xml_tree import Element, read_xml
from forcemap.errors import InputError, UnknownName
from forcemap.findings import Finding, FindingKind

_MOST_LINKS = 500  # a choice: far above any robot's, and soon read
_MOST_LISTED = 6  # names in a message that has to stay one line
_FIXED = "fixed"


def read_urdf(path: str | Path, *, base: str | None = None, tip: str | None = None) -> Robot:
    """Read a robot from a URDF: fixed, revolute, continuous and prismatic joints, masses and inertias.

    Meshes, materials and controllers are not read. A link without <inertial> has no mass, as the format says. Joints
    that do not lie between base and tip, such as the fingers of a gripper, are held where they are nearest to zero;
    what they carry is carried along, and `Robot.held_joints` names them. Only the chain from base to tip has to be
    sound: what hangs on it and cannot be used counts as far as it can, `Robot.findings` says how, and what does not
    move is not looked at.

    Parameters
    ----------
    path : str or Path
        The file; a xacro file becomes a URDF by running xacro on it.
    base : str, optional
        Link whose frame distances and heights refer to; if not given, the root.
    tip : str, optional
        Link whose frame is the flange, its z axis the direction of the tool unless `Robot.with_tool` names another
        axis; if not given, the only end of the tree.

    Raises
    ------
    InputError
        The file cannot be read, or does not describe a tree of links; the chain has an impossible inertia or limit, or
        figures in another unit than m, kg, kg m^2 and rad.
    UnknownName
        No link is named as base or tip says.
    """
    file, root = Path(path).name, read_xml(path)
    if root.tag != "robot":
        raise root.refused(f"found <{root.tag}>, expected <robot>: a URDF")
    if any(child.tag.startswith("xacro:") for child in root.children):
        raise root.refused("this is a xacro file, expected a URDF; run xacro on it first")
    links = _named(root.all("link"))
    tree = _LinkTree(
        file, links, [_link_joint(*named_joint, links) for named_joint in _named(root.all("joint")).items()]
    )
    chain, side_links = tree.chain(base, tip), _SideLinks()
    first = next(place for place, joint in enumerate(chain) if joint.kind != _FIXED)
    length = sum(origin_length(joint.element, joint.name, _origin(joint.element)) for joint in chain[first + 1 :])
    frame, joints, bodies = Frame.of(), list[Joint](), list[Body]()
    for link_joint in chain:  # fixed joints become part of the origins and bodies of those that move
        frame = frame.then(_origin(link_joint.element))
        if link_joint.kind != _FIXED:
            joints.append(_moving(link_joint, frame))
            frame = Frame.of()
        if joints:  # what stands before the first of them does not move
            bodies.append(side_links.with_mass(links[link_joint.child], _link_body(links[link_joint.child])))
            joints[-1] = joints[-1].with_body(bodies[-1], frame)
            joints[-1] = joints[-1].with_body(tree.carried(link_joint.child, chain, side_links), frame)
    if not any(joint.body.mass > 0 for joint in joints):
        raise InputError("no link that moves has a mass, expected <inertial> elements", file=file)
    refuse_masses(bodies, length, file)
    return Robot(
        name=root.attributes.get("name") or file,
        source=f"{file}, from {chain[0].parent!r} to {chain[-1].child!r}",
        joints=tuple(joints),
        flange=frame,
        reference_posture=np.array([_middle(joint) for joint in joints]),
        held_joints=tuple(side_links.held_joints),
        findings=tuple(side_links.findings),
    )


def _named(elements: Iterable[Element]) -> dict[str, Element]:
    """Elements by name; every one must have a name, and no two the same."""
    named: dict[str, Element] = {}
    for element in elements:
        if named.setdefault(name := element.text("name"), element) is not element:
            raise element.refused(f"a second {element.tag} is named {name!r}, expected a name of its own")
    return named


def _link_body(link: Element, *, point: bool = False) -> Body:
    """Body of a link in the link's frame; its mass as a point mass if `point`."""
    inertial = link.first("inertial")
    if inertial is None:
        return NOTHING
    what, matrix = f"link {link.attributes['name']!r}", np.zeros((3, 3))
    (mass,) = inertial.inside("mass").numbers("value")
    if not point:
        inertia = inertial.inside("inertia")
        matrix = np.array([[inertia.numbers(f"i{min(a, b)}{max(a, b)}")[0] for b in "xyz"] for a in "xyz"])
    try:  # no body has an inertia without a mass, but many files say so: it counts as stated, with a finding
        body = replace(Body.of(mass or 1.0, np.zeros(3), matrix), mass=mass)
    except InputError as error:
        raise inertial.refused(f"{what}: {error.message}") from None
    body = moved_body(body, _origin(inertial))
    refuse_body(inertial, what, body)
    return body


def _link_joint(name: str, joint: Element, links: Iterable[str]) -> _LinkJoint:
    ends = {end: joint.inside(end).text("link") for end in ("parent", "child")}
    for end, link in ends.items():
        if link not in links:
            raise joint.inside(end).refused(f"joint {name!r}: there is no link named {link!r}, its {end}")
    return _LinkJoint(joint, name, **ends)


def _moving(joint: _LinkJoint, origin: Frame) -> Joint:
    """A joint that moves, its frame in that of the one before; nothing hangs on it yet."""
    if joint.kind not in (kinds := (_FIXED, *JointKind)):
        problem = f"joint {joint.name!r}: found the type {joint.kind!r}, expected one of {', '.join(kinds)}"
        raise joint.element.refused(f"{problem}; if it moves the whole robot, name the link after it as the base")
    what, kind, element = f"joint {joint.name!r}", JointKind(joint.kind), joint.element.first("axis")
    axis = np.array([1.0, 0.0, 0.0] if element is None else element.numbers("xyz", 3))
    length = np.linalg.norm(axis)
    if not 1e-9 < length < math.inf:  # a shorter axis is a zero with rounding
        raise joint.element.refused(f"{what}: found an axis of length {length:g}, expected 1")
    lower, upper = -math.inf, math.inf
    if kind is not JointKind.CONTINUOUS:
        limit = joint.element.inside("limit")
        stated = {key: limit.numbers(key, largest=math.inf)[0] for key in ("lower", "upper") if key in limit.attributes}
        ends = stated.get("lower", 0.0), stated.get("upper", 0.0)
        lower, upper = joint_limits(limit, what, *ends, slides=kind is JointKind.PRISMATIC)
    return Joint(joint.name, kind, origin, axis / length, lower, upper, NOTHING)


def _middle(joint: Joint) -> float:
    """Middle of a joint's range; the allowed position nearest to zero if it is not limited on both sides."""
    bounded = math.isfinite(joint.lower) and math.isfinite(joint.upper)
    return (joint.lower + joint.upper) / 2 if bounded else min(max(0.0, joint.lower), joint.upper)


def _origin(element: Element) -> Frame:
    if (origin := element.first("origin")) is None:
        return Frame.of()
    stated = {key: origin.numbers(key, 3) for key in ("xyz", "rpy") if key in origin.attributes}
    refuse_turns(origin, stated.get("rpy", [0.0]))
    return Frame.of(**stated)


@dataclass(frozen=True, eq=False)
class _LinkJoint:
    """A joint of the file, between two links; what else it says is read where it counts."""

    element: Element
    name: str
    parent: str
    child: str

    @property
    def kind(self) -> str:
        return self.element.text("type")


@dataclass(frozen=True, eq=False)
class _SideLinks:
    """Links that hang on the chain beside it, as far as they can be used, and findings on what cannot be."""

    held_joints: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def frame(self, joint: _LinkJoint) -> Frame:
        """Frame of a joint beside the chain, held as near to zero as its limits allow.

        Raises
        ------
        InputError
            Its frame is not known, so that nothing on it can be placed.
        """
        origin = _origin(joint.element)
        origin_length(joint.element, joint.name, origin)
        if joint.kind == _FIXED:
            return origin
        self.held_joints.append(joint.name)
        try:
            return _moving(joint, origin).frame_nearest_zero()
        except InputError as error:
            self._say(FindingKind.JOINT_AT_ZERO, joint.element, error)
            return origin

    def body(self, link: Element) -> Body:
        """Body of a link beside the chain: a point mass if its inertia cannot be used, nothing if its mass cannot."""
        try:
            return self.with_mass(link, _link_body(link))
        except InputError as error:
            try:
                body, kind = _link_body(link, point=True), FindingKind.LINK_AS_POINT_MASS
            except InputError:
                body, kind = NOTHING, FindingKind.LINK_LEFT_OUT
            self._say(kind, link, error)
            return body

    def with_mass(self, link: Element, body: Body) -> Body:
        """The body; a finding says if it has an inertia but no mass."""
        if body.mass == 0 and body.inertia.any():
            figures = {"link": link.attributes["name"], "inertia_kg_m2": float(np.linalg.eigvalsh(body.inertia)[-1])}
            self.findings.append(Finding.of(FindingKind.INERTIA_WITHOUT_MASS, **figures))
        return body

    def left_out(self, joint: _LinkJoint, error: InputError) -> None:
        """Note that nothing that hangs on a joint can be placed."""
        self._say(FindingKind.JOINT_LEFT_OUT, joint.element, error)

    def _say(self, kind: FindingKind, element: Element, why: InputError) -> None:
        self.findings.append(Finding.of(kind, name=element.attributes["name"], why=why.message, row=why.row))


@dataclass(frozen=True, eq=False)
class _LinkTree:
    """Links and the joints between them.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    links : dict of str to Element
        Links by their names.
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
    links: dict[str, Element]
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
            raise self._refused(
                f"the robot ends in the links {listed}; name the one that is the flange as the tip (--tip)"
            )
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
        if all(joint.kind == _FIXED for joint in chain):
            raise self._refused(f"no joint moves between {first!r} and {last!r}, expected at least one")
        for joint in chain:
            if joint.element.first("mimic"):
                raise joint.element.refused(f"joint {joint.name!r} mimics another, expected free joints up to the tip")
        return chain

    def carried(self, link: str, chain: list[_LinkJoint], side_links: _SideLinks) -> Body:
        """Body of all that hangs on a link beside the chain, in the frame of the link."""
        bodies = []
        for joint in self.joints:
            if joint.parent == link and joint not in chain:
                try:
                    frame = side_links.frame(joint)
                except InputError as error:
                    side_links.left_out(joint, error)
                    continue
                bodies += [moved_body(side_links.body(self.links[joint.child]), frame)]
                bodies += [moved_body(self.carried(joint.child, chain, side_links), frame)]
        return united(bodies)

    def _refused(self, message: str) -> InputError:
        return InputError(message, file=self.file)


def _listed(names: list[str]) -> str:
    more = len(names) - _MOST_LISTED
    return ", ".join(map(repr, names[:_MOST_LISTED])) + (f" and {more} more" if more > 0 else "")
