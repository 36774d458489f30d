"""An XML file as a tree whose elements know their line, so that messages can name it.

The parser is Python's own (expat). A document type is refused before anything in it is looked at: descriptions of
robots have none, and it could name other files or entities that grow without end.
"""

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from fe_models.foundation.paths import near_file
from fe_models.foundation.words import quoted, shortened
from floatframe.errors import UrdfError

__all__ = ["Element", "read_xml"]

MOST_BYTES = 50_000_000  #: a robot of hundreds of links has some 100 kB
MOST_NESTED = 50


@dataclass(eq=False)
class Element:
    """An element with its attributes and the elements in it."""

    tag: str
    attributes: dict[str, str]
    line: int  #: of the file, from 1
    children: list["Element"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        """Return the elements of a tag in it, in the order of the file."""
        return [child for child in self.children if child.tag == tag]


def read_xml(path: Path, root: str) -> Element:
    """Return the tree of a file.

    Raises
    ------
    UrdfError
        If there is no such file, it is no well-formed XML, too large, or its first element is another.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise UrdfError(f"{path}: expected a file of up to {MOST_BYTES // 1_000_000} MB, got {size / 1e6:.0f} MB")
        content = path.read_bytes()
    except FileNotFoundError:
        raise UrdfError(f"{path}: no such file{near_file(path)}") from None
    except OSError as error:
        raise UrdfError(f"{path}: cannot be read: {error.strerror}") from error
    tree = parsed(path, content)
    if tree.tag != root:
        raise UrdfError(f"{path}, line {tree.line}: expected <{root}> as first element, got <{shortened(tree.tag)}>")
    return tree


def parsed(path: Path, content: bytes) -> Element:
    """Return the first element of a content with all that is in it."""
    parser = expat.ParserCreate()
    top = Element("", {}, 0)
    open_elements = [top]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > MOST_NESTED:
            raise UrdfError(f"{path}, line {parser.CurrentLineNumber}: elements are nested deeper than {MOST_NESTED}")
        element = Element(tag, attributes, parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def doctype(name: str, *_: object) -> None:
        raise UrdfError(
            f"{path}, line {parser.CurrentLineNumber}: expected no document type, got <!DOCTYPE {quoted(name)}>; "
            "take it out"
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _: open_elements.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise UrdfError(f"{path}, line {error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}") from None
    except (ValueError, LookupError) as error:  # an encoding that does not exist
        raise UrdfError(f"{path}: cannot be read as XML: {error}") from None
    return top.children[0]
