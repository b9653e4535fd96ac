"""The tree of links of a robot description."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from forcemap.dynamics.rigid_body import Body, moved_body, united
from forcemap.dynamics.urdf_entries import JointEntry
from forcemap.errors import InputError, UnknownName

_MOST_LINKS = 500


@dataclass(frozen=True, eq=False)
class LinkTree:
    """Links and the joints between them.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    links : dict of str to Body
        Bodies by the name of the link.
    joints : tuple of JointEntry
        The joints.

    Raises
    ------
    InputError
        No tree: no link, several roots, a link with two parents, or a loop.
    """

    file: str
    links: dict[str, Body]
    joints: tuple[JointEntry, ...]

    def __post_init__(self) -> None:
        if not 0 < len(self.links) <= _MOST_LINKS:
            raise self._refused(f"found {len(self.links)} links, expected 1 to {_MOST_LINKS}")
        carrying: dict[str, JointEntry] = {}
        for joint in self.joints:
            other = carrying.setdefault(joint.child, joint)
            if other is not joint:
                raise self._refused(
                    f"the joints {other.name!r} and {joint.name!r} both carry the link {joint.child!r}, expected one",
                    joint,
                )
        roots = [name for name in self.links if name not in carrying]
        if len(roots) > 1:
            raise self._refused(f"the links {_listed(roots)} hang on nothing, expected one root for all links")
        reached = set(roots)
        while grown := {joint.child for joint in self.joints if joint.parent in reached} - reached:
            reached |= grown
        if loop := [name for name in self.links if name not in reached]:
            raise self._refused(f"the links {_listed(loop)} form a loop, expected a tree")

    @property
    def root(self) -> str:
        """The link that hangs on nothing."""
        carried = {joint.child for joint in self.joints}
        return next(name for name in self.links if name not in carried)

    @property
    def end(self) -> str:
        """The only link on which nothing hangs.

        Raises
        ------
        InputError
            There are several.
        """
        parents = {joint.parent for joint in self.joints}
        ends = [name for name in self.links if name not in parents]
        if len(ends) > 1:
            raise self._refused(
                f"the robot ends in the links {_listed(ends)}; name the one that is the flange as the tip"
            )
        return ends[0]

    def chain(self, base: str, tip: str) -> list[JointEntry]:
        """Joints from the base to the tip.

        Raises
        ------
        UnknownName
            No link is named so.
        InputError
            The tip does not hang on the base, no joint moves between them, or one mimics another.
        """
        for link in (base, tip):
            if link not in self.links:
                raise UnknownName(f"link of {self.file}", link, self.links)
        carrying = {joint.child: joint for joint in self.joints}
        chain: list[JointEntry] = []
        link = tip
        while link != base:
            if link not in carrying:
                raise self._refused(f"the link {tip!r} does not hang on {base!r}; name another base or tip")
            chain.insert(0, carrying[link])
            link = carrying[link].parent
        if all(joint.kind is None for joint in chain):
            raise self._refused(f"no joint moves between {base!r} and {tip!r}, expected at least one")
        for joint in chain:
            if joint.mimics:
                raise self._refused(f"joint {joint.name!r} mimics another, expected free joints up to the tip", joint)
        return chain

    def carried(self, link: str, chain: set[str]) -> tuple[Body, list[str]]:
        """Body of a link with all that hangs on it beside the chain, and the names of the joints held for it."""
        bodies, held = [self.links[link]], []
        for joint in self.joints:
            if joint.parent == link and joint.name not in chain:
                body, inner = self.carried(joint.child, chain)
                bodies.append(moved_body(body, joint.held()))
                held += [joint.name] * (joint.kind is not None) + inner
        return united(bodies), held

    def _refused(self, message: str, joint: JointEntry | None = None) -> InputError:
        return InputError(message, file=self.file, row=joint.line if joint else None)


def _listed(names: Iterable[str]) -> str:
    listed = [repr(name) for name in names]
    return ", ".join(listed[:6]) + (f" and {len(listed) - 6} more" if len(listed) > 6 else "")
