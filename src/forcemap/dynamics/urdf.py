"""Robots from a URDF of the user's."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from forcemap.dynamics.link_tree import LinkTree
from forcemap.dynamics.rigid_body import Body, Frame, moved_body, united
from forcemap.dynamics.robot import Joint, Robot
from forcemap.dynamics.urdf_entries import JointEntry, joint_entry, link_body, named_elements
from forcemap.dynamics.xml_tree import read_xml
from forcemap.errors import InputError


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
    file = Path(path).name
    root = read_xml(path)
    if root.tag != "robot":
        raise InputError(f"found <{root.tag}>, expected <robot>: a URDF", file=file, row=root.line)
    if any(child.tag.startswith("xacro:") for child in root.children):
        raise InputError("this is a xacro file, expected a URDF; run xacro on it first", file=file, row=root.line)
    links = {name: link_body(link, file) for name, link in named_elements(root.all("link"), file).items()}
    joints = named_elements(root.all("joint"), file).values()
    tree = LinkTree(file, links, tuple(joint_entry(joint, links, file) for joint in joints))
    chain = tree.chain(tree.root if base is None else base, tree.end if tip is None else tip)
    return _robot(root.attributes.get("name") or file, tree, chain)


@dataclass
class _Stretch:
    """A moving joint with the fixed ones behind it, up to the next that moves."""

    joint: JointEntry
    origin: Frame
    end: Frame = field(default_factory=Frame.of)
    bodies: list[Body] = field(default_factory=list)


def _robot(name: str, tree: LinkTree, chain: list[JointEntry]) -> Robot:
    """The chain, its fixed joints taken into the origins and bodies of those that move."""
    names = {joint.name for joint in chain}
    before, stretches, held = Frame.of(), list[_Stretch](), list[str]()
    for joint in chain:
        if joint.kind is not None:
            stretches.append(_Stretch(joint, (stretches[-1].end if stretches else before).then(joint.origin)))
        elif stretches:
            stretches[-1].end = stretches[-1].end.then(joint.origin)
        else:
            before = before.then(joint.origin)
            continue  # what stands before the first moving joint does not move
        body, beside = tree.carried(joint.child, names)
        stretches[-1].bodies.append(moved_body(body, stretches[-1].end))
        held += beside
    joints = tuple(_joint(stretch) for stretch in stretches)
    if not any(joint.body.mass > 0 for joint in joints):
        raise InputError("no link that moves has a mass, expected <inertial> elements", file=tree.file)
    return Robot(
        name=name,
        source=f"{tree.file}, from {chain[0].parent!r} to {chain[-1].child!r}",
        joints=joints,
        flange=stretches[-1].end,
        reference_posture=np.array([_middle(joint) for joint in joints]),
        contact_offset=np.zeros(3),
        held_joints=tuple(held),
    )


def _joint(stretch: _Stretch) -> Joint:
    entry = stretch.joint
    assert entry.kind is not None
    body = united(stretch.bodies)
    return Joint(entry.name, entry.kind, stretch.origin, entry.axis, entry.lower, entry.upper, body)


def _middle(joint: Joint) -> float:
    return 0.0 if math.isinf(joint.lower) else (joint.lower + joint.upper) / 2
