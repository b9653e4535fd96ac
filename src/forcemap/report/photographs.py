"""Photographs and sketches of contact points as a report shows them: re-encoded, small, without metadata."""

from __future__ import annotations

import base64
import io
import warnings
from pathlib import Path

from markupsafe import Markup, escape
from PIL import Image, ImageFile, ImageOps

from forcemap.errors import InputError
from forcemap.files import read_bytes, sha256

MOST_PIXELS = 50_000_000
"""Pixels of a photograph at most; a choice: what cameras take."""

_LARGEST_FILE = 30_000_000  # bytes; a choice
_EDGE = 900  # pixels of the longer edge in a report; a choice
_MOST_BYTES = 60_000  # of a picture in a report, so that 300 of them stay below 30 MB
_QUALITIES = (80, 60, 40)
_FORMATS = {"JPEG": "image/jpeg", "PNG": "image/png"}


def shown_photograph(path: Path, digest: str, words: str) -> Markup:
    """A photograph as an <img> element with its data in it.

    Parameters
    ----------
    path : Path
    digest : str
        SHA-256 that the file had when the assessment was made.
    words : str
        What it shows.

    Raises
    ------
    InputError
        Gone, changed meanwhile, neither JPEG nor PNG, too large, or damaged.
    """
    content = read_bytes(path)
    if digest and sha256(content) != digest:
        raise InputError("it was changed while the report was made", file=path.name)
    kind, encoded = reencoded(content, path.name)
    data = base64.b64encode(encoded).decode()
    return Markup('<img class="photograph" alt="{}" src="data:{};base64,{}">').format(escape(words), kind, Markup(data))


def reencoded(content: bytes, file: str) -> tuple[str, bytes]:
    """A JPEG or PNG picture decoded and encoded anew: its media type and its bytes, upright, without metadata.

    Raises
    ------
    InputError
        Neither of both, too large, or damaged.
    """
    if len(content) > _LARGEST_FILE:
        raise InputError(f"found {len(content) / 1e6:.0f} MB, expected at most {_LARGEST_FILE / 1e6:.0f} MB", file=file)
    lenient = ImageFile.LOAD_TRUNCATED_IMAGES
    try:
        ImageFile.LOAD_TRUNCATED_IMAGES = False  # whoever makes PDF files has set it for the whole process
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(content), formats=tuple(_FORMATS)) as opened:
                if opened.width * opened.height > MOST_PIXELS:
                    most = f"expected at most {MOST_PIXELS / 1e6:.0f} million pixels"
                    raise InputError(f"found {opened.width} x {opened.height}, {most}", file=file)
                opened.draft("RGB", (_EDGE, _EDGE))  # a JPEG is decoded at the size that is needed
                sketch, upright = opened.format == "PNG", ImageOps.exif_transpose(opened)
                picture = Image.new("RGB", upright.size, "white")
                whole = upright.convert("RGBA")
                picture.paste(whole, mask=whole.getchannel("A"))
    except InputError:
        raise
    except Exception as error:  # a damaged picture raises whatever its decoder does
        raise InputError(f"no JPEG or PNG picture that can be read ({error})", file=file) from None
    finally:
        ImageFile.LOAD_TRUNCATED_IMAGES = lenient
    picture.thumbnail((_EDGE, _EDGE))
    if sketch and len(drawn := _encoded(picture, "PNG", optimize=True)) <= _MOST_BYTES:
        return _FORMATS["PNG"], drawn
    while True:
        for quality in _QUALITIES:
            taken = _encoded(picture, "JPEG", quality=quality)
            if len(taken) <= _MOST_BYTES:
                return _FORMATS["JPEG"], taken
        picture = picture.resize((max(1, picture.width // 2), max(1, picture.height // 2)))


def _encoded(picture: Image.Image, kind: str, **options: int) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return stream.getvalue()
