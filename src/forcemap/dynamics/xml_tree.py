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


@dataclass(frozen=True)
class Element:
    """An element of an XML file: tag, attributes, line and the elements in it."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """The elements of that tag directly in this one."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The first of them, if there is one."""
        return next(self.all(tag), None)


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
    tree = _Tree()
    try:
        parse(io.BytesIO(content), tree, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except DefusedXmlException:
        raise InputError(
            "found a DTD or entities, which a robot description does not need; remove the <!DOCTYPE ...> part",
            file=file,
        ) from None
    except SAXParseException as error:
        raise InputError(
            f"not well-formed XML ({error.getMessage()}), expected a URDF", file=file, row=error.getLineNumber()
        ) from None
    except (ValueError, LookupError):  # an encoding that does not exist
        raise InputError("the text is in an encoding that is not known, expected UTF-8", file=file) from None
    return tree.top.children[0]


class _Tree(xml.sax.handler.ContentHandler):
    def __init__(self) -> None:
        super().__init__()
        self.top = Element("", {}, 0)
        self.open = [self.top]

    def setDocumentLocator(self, locator: Any) -> None:
        self.locator = locator

    def startElement(self, name: str, attrs: Any) -> None:
        element = Element(name, dict(attrs.items()), self.locator.getLineNumber() or 0)
        self.open[-1].children.append(element)
        self.open.append(element)

    def endElement(self, name: str) -> None:
        self.open.pop()
