"""XML as a tree that knows its lines; entities, DTDs and anything outside the file are refused."""

from __future__ import annotations

import io
import xml.sax.handler
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from forcemap.errors import InputError
from forcemap.files import read_bytes

_LARGEST = 1e9  # a choice: far above any robot's figures, and products of such numbers stay finite


@dataclass(frozen=True)
class Element:
    """An element of an XML file: tag, attributes, file and line, and the elements in it.

    If something that must be there is missing, an InputError names the line.
    """

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """The elements of that tag directly in this one."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The first element of that tag directly in this one, if any."""
        return next(self.all(tag), None)

    def inside(self, tag: str) -> Element:
        """The first element of that tag directly in this one, which must be there."""
        if child := self.first(tag):
            return child
        name = f" {self.attributes['name']!r}" if "name" in self.attributes else ""
        raise self.refused(f"{self.tag}{name} has no <{tag}>, expected one")

    def text(self, key: str) -> str:
        """An attribute, which must be there."""
        if value := self.attributes.get(key, "").strip():
            return value
        raise self.refused(f'<{self.tag}> has no {key}, expected {key}="..."')

    def numbers(self, key: str, count: int = 1, *, largest: float = _LARGEST) -> list[float]:
        """An attribute of `count` numbers (one or three), none larger than `largest`."""
        text = self.text(key)
        try:
            numbers = [float(part) for part in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != count or "_" in text or not all(abs(number) <= largest for number in numbers):
            words = "a finite number" if count == 1 else "three finite numbers"
            raise self.refused(f"<{self.tag} {key}>: found {text!r}, expected {words}")
        return numbers

    def refused(self, message: str) -> InputError:
        """An error that names the file and the line of this element."""
        return InputError(message, file=self.file, row=self.line)


def read_xml(path: str | Path) -> Element:
    """Root element of an XML file.

    Raises
    ------
    InputError
        No such file, not well-formed XML, or XML with a DTD or entities: they can blow a small file up, or read others.
    """
    from xml.sax import SAXParseException

    from defusedxml import DefusedXmlException
    from defusedxml.sax import parse

    file, content = Path(path).name, read_bytes(path)
    tree = _Tree(file)
    try:
        parse(io.BytesIO(content), tree, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except DefusedXmlException:
        message = "found a DTD or entities, which a robot description does not need; remove the <!DOCTYPE ...> part"
        raise InputError(message, file=file) from None
    except SAXParseException as error:
        message = f"not well-formed XML ({error.getMessage()}), expected a URDF"
        raise InputError(message, file=file, row=error.getLineNumber()) from None
    except (ValueError, LookupError):  # an encoding that does not exist
        raise InputError("the text is in an encoding that is not known, expected UTF-8", file=file) from None
    return tree.open[0].children[0]


class _Tree(xml.sax.handler.ContentHandler):
    def __init__(self, file: str) -> None:
        super().__init__()
        self.open = [Element("", {}, file, 0)]

    def setDocumentLocator(self, locator: Any) -> None:
        self.locator = locator

    def startElement(self, name: str, attrs: Any) -> None:
        element = Element(name, dict(attrs.items()), self.open[0].file, self.locator.getLineNumber() or 0)
        self.open[-1].children.append(element)
        self.open.append(element)

    def endElement(self, name: str) -> None:
        self.open.pop()
