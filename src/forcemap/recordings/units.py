"""The units devices write, and those a column's name, or a cell of a line of units, states: one table of spellings."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Iterator
from enum import StrEnum
from itertools import pairwise
from typing import TypeAlias


class TimeUnit(StrEnum):
    """Unit of the time column."""

    SECONDS = "s"
    MILLISECONDS = "ms"
    MICROSECONDS = "us"
    NANOSECONDS = "ns"

    @property
    def per_second(self) -> float:
        """How many of it make a second."""
        return 1e3 ** list(TimeUnit).index(self)


class ForceUnit(StrEnum):
    """Unit of the force columns; counts are the raw figures of a converter, or any other unit with a known factor."""

    NEWTONS = "N"
    KILONEWTONS = "kN"
    COUNTS = "counts"

    @property
    def newtons(self) -> float:
        """How many newtons it is; NaN for counts, whose factor a column map states."""
        return {"N": 1.0, "kN": 1e3, "counts": math.nan}[self.value]


def listed(units: Iterable[TimeUnit | ForceUnit]) -> str:
    """Units as a sentence lists them: N or kN."""
    *first, last = (unit.value for unit in units)
    return f"{', '.join(first)} or {last}"


Unit: TypeAlias = TimeUnit | ForceUnit

# symbols as they are: [S] is no second, [MS] no millisecond; words in any case
_SYMBOLS: dict[str, Unit] = {"µs": TimeUnit.MICROSECONDS}
_SYMBOLS |= {unit.value: unit for unit in TimeUnit}
_SYMBOLS |= {unit.value: unit for unit in ForceUnit}
_SPELLINGS: dict[Unit, str] = {
    TimeUnit.SECONDS: "sec secs second seconds sek sekunde sekunden seconde secondes secondi segundos",
    TimeUnit.MILLISECONDS: "msec msecs millisec millisecond milliseconds millisekunde millisekunden millisecondes",
    TimeUnit.MICROSECONDS: "usec usecs µsec microsec microsecond microseconds mikrosekunde mikrosekunden",
    TimeUnit.NANOSECONDS: "nsec nsecs nanosec nanosecond nanoseconds nanosekunde nanosekunden",
    ForceUnit.NEWTONS: "newton newtons",
    ForceUnit.KILONEWTONS: "knewton knewtons kilonewton kilonewtons",
    ForceUnit.COUNTS: "counts count cnt cnts digit digits bit bits lsb incr inkremente",
}
_WORDS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
# what forcemap does not read, in any case: other forces, other times, and what is neither
_FORCE_WORDS = """
    kilon hn hectonewton decinewton lbf lb lbs pound pounds kgf kp kg kilogram kilograms kilogramm gf gram grams
    gramm ozf oz dan dn cn mn µn un gn dekanewton decanewton millinewton meganewton tf tonf ton tons tonne tonnes
    kip kips klbf dyn dyne pdl sn
"""
_TIME_WORDS = "min mins minute minutes minuten hr hrs hour hours std stunden day days ps"
_OTHER_WORDS = """
    sample samples pa hpa kpa mpa gpa bar mbar psi ksi volt volts millivolt millivolts mv µv uv kv ma µa ua amp amps
    voltage spannung ampere ohm pc nc µc coulomb picocoulomb % %fs %fso %rdg ppm mm cm µm um inch hz khz mhz °c degc
    deg rad nm ncm nmm knm joule mj kj kns
"""
_OTHER_FORCES, _OTHER_TIMES = frozenset(_FORCE_WORDS.split()), frozenset(_TIME_WORDS.split())
_OTHERS = _OTHER_FORCES | _OTHER_TIMES | frozenset(_OTHER_WORDS.split())
# a word for a power of ten anywhere in a name, and a sign for one right before the unit: "Kilo-Newton", "k N"
_TEN_WORDS = """
    deca deka hecto hekto kilo mega giga deci dezi centi zenti milli micro mikro nano tenfold
    ten tens tenth tenths hundred hundreds hundredth hundredths thousand thousands thousandth thousandths
    zehn zehner zehntel zehntels hundert hunderter hundertstel tausend tausender tausendstel
    dix dizaine dizaines centaine centaines mille millier milliers dixieme dixiemes dieci decine centinaia migliaia
    faktor factor facteur fattore scaled skaliert
"""
_FULL_WIDTH = {0xFEE0 + code: code for code in range(0x21, 0x7F)}  # letters as East Asian programs write them
_POWERS_OF_TEN = frozenset(_TEN_WORDS.split())
_PREFIXES = _POWERS_OF_TEN | {"da", *"hkmgdcµun"}
_ONE_LETTER = frozenset("gtVAmhdJKCW%")  # a unit where nothing else can stand: in brackets, after a comma
_AT_END = {True: frozenset("shmd"), False: frozenset("N")}  # of times, of forces: F_s, F_t, F_h are no units
LONGEST_NAME = 300  # characters
_FOLDED = frozenset(symbol.casefold() for symbol in _SYMBOLS)
_WITH_ANOTHER = re.compile(rf"(?:{'|'.join(map(re.escape, _SYMBOLS))})\s?[/*·⋅^].*")
_PARTS = re.compile(r"\s?[/*·⋅^]\s?|(?<=\w)\s(?=\w)")

_ANY_BRACKET = re.compile(r"[\[\](){}<>]")
_BRACKETS = re.compile(r"[\[({<]([^\[\](){}<>]*)[\])}>]")
_LAST = re.compile(r".*?(\s+in\s+|\s*[,/]\s*|[_\s.-]\s*)([^\s,_\[\](){}<>]+(?:\s?[/*·]\s?[^\s,_\[\](){}<>]+)?)\s*")
_NO_UNIT = re.compile(
    r"|f?[xyz]|t|[0-9]+|tcp|tool|base|abs|norm|sum|magnitude|filtered|gefiltert|relative?|absolute?|measured|gemessen|"
    r"actual|ist|cfc ?[0-9]+|(?:ch|channel|kanal|sensor).*"
)
# within longer words, and factors before or behind a unit: "ForceKgf", "Force*10 [N]", "x10N"; words of units that are
# read, too, for they may be others than the one that is stated; no counts ("Discounts"), nothing short ("redundant")
_SHORT = 4  # letters
_READ_WITHIN = (w for u in ForceUnit if u is not ForceUnit.COUNTS for w in _SPELLINGS[u].split() if len(w) > _SHORT)
_WITHIN = re.compile("|".join(("kilopond", "kgf", "kilogram", "lbf", "pound", *_READ_WITHIN)), re.IGNORECASE)
_TENFOLD = rf"10+\s?(?:{'|'.join(unit.value for unit in ForceUnit if unit is not ForceUnit.COUNTS)})\b"
_FACTOR = re.compile(
    rf"[x×*/]\s?10+(?![0-9])|(?<![0-9A-Za-z]){_TENFOLD}|(?<![0-9])1/[0-9]|10\s?\^|(?<![0-9])1e[+-]?[0-9]|"
    r"(?<![0-9])0[.,]0*1\s?(?=[^\W\d])|(?<![0-9A-Za-z])10+\s?(?:[x×*]|er\b)|\bper\s10+\b",
    re.IGNORECASE,
)
# a power of ten grown onto the unit, and a sign for one onto a name: "dekaN", "ForcekN"
_GROWN = re.compile(
    r"(?:(?<=[^\W\d_])(?:k|da|h|d|c|m|M|µ|n|·)|(?<![^\W\d_])(?:[kK]ilo|[dD]e[ck]a|[hH]e[ck]to|[mM]illi))"
    r"N(?![A-Za-z])"
)
# a force with a length or a time is a torque, a stiffness or an impulse, however both are joined: "mNm", "N_m", "ft-lb"
_POUNDS = "kgf?|kp|lbf?|ozf?"
_PRODUCT = re.compile(
    rf"(?<![^\W\d_])(?:(?:(?:da|[khdcmunµMG])?N|[nN]ewtons?|{_POUNDS})(?:[\s_.·*×^-]|per|pro|p|x)*"
    rf"(?:[cmdkµ]?m(?:et(?:er|re|ro)s?)?|m?s(?:ec(?:onds?)?)?|ft)|(?:{_POUNDS})[\s_.·*-]*in(?:ch(?:es)?)?|"
    rf"(?:ft|in|inch|[cmk]?m)[\s_.·*-]*(?:{_POUNDS})s?)(?![^\W_])"
)
_NO_FORCE_WORDS = """
    torque torsion moment moments momente momento momenti drehmoment couple coppia mx my mz tx ty tz
    stiffness steifigkeit impulse impuls energy energie pressure pression pressione presion df
"""
_NO_FORCE, _FORCE = (
    frozenset(_NO_FORCE_WORDS.split()),
    frozenset(("force", "forces", "kraft", "f", "fx", "fy", "fz", "fn")),
)
_AFTER_UNIT = re.compile(r"[\])}>]\s*(?:[/*·]|(?:per|pro)\b)")
_DOTS = dict.fromkeys(map(ord, "∙⋅•"), ord("·"))
_UNIT_WORD = re.compile(
    r"units?\b|\bdimension\b|\beinheit(?:en)?\b|unit_label|\bunités?\b|\bunidad\b|\bunità\b", re.IGNORECASE
)
_PLAIN = re.compile(r"([a-z]+)(?:\s*[_/,]\s*|\s+in\s+)([^\s\[\](){}<>]+)|([a-z]+)\s*[\[(]\s*(.*?)\s*[\])]", re.I)
_PLAIN_WORDS: dict[type, tuple[str, ...]] = {
    TimeUnit: ("t", "time", "zeit", "temps"),
    ForceUnit: ("f", "force", "kraft"),
}


def stated_unit(name: str, *, alone: bool = False, of_time: bool = False) -> Unit | str | None:
    """The unit that a column's name states: one that forcemap reads, the words of another one, or None.

    What stands in brackets is a unit, known or not, unless it is a known remark such as (TCP); what ends a name without
    them is one only if it is known.

    Parameters
    ----------
    name : str
        The name, or the cell of a line of units.
    alone : bool
        The text is a unit and nothing else, if it is known at all.
    of_time : bool
        The column is one of times.

    >>> stated_unit("Zeit [ms]"), stated_unit("force_kN"), stated_unit("Force [lbf]"), stated_unit("Fz")
    (<TimeUnit.MILLISECONDS: 'ms'>, <ForceUnit.KILONEWTONS: 'kN'>, 'lbf', None)
    """
    text = _plain(name)
    if len(text) > LONGEST_NAME:
        return None
    found = _stated_unit(text, alone, of_time)
    if of_time or not (found is None or isinstance(found, ForceUnit)):
        return found
    apart = _words(text)
    words = {*apart, *map("".join, pairwise(apart))}  # "M_z" as "Mz"
    of_another = found is not None and not _NO_FORCE.isdisjoint(words) and _FORCE.isdisjoint(words)
    of_another |= found is not None and _AFTER_UNIT.search(text) is not None
    return text if of_another or _PRODUCT.search(_ANY_BRACKET.sub(" ", text)) else found


def _stated_unit(text: str, alone: bool, of_time: bool) -> Unit | str | None:
    """The unit that a name seems to state; arguments and result as in `stated_unit`."""
    if _FACTOR.search(text) or not _POWERS_OF_TEN.isdisjoint(_words(text)):
        return text
    if not of_time and not alone and not in_brackets(text) and _GROWN.search(text) and not _known(text):
        return text
    bracketed = [match.strip() for match in _BRACKETS.findall(text)]
    if alone:
        return _known(bracketed[0] if in_brackets(text) else text, one_letter=True)
    stated = [words for words in bracketed if not _NO_UNIT.fullmatch(words.casefold())]
    if stated:  # of several, a known one that is not read counts first, one that nobody knows last
        units = [_known(words, one_letter=True) for words in stated]
        read = list(dict.fromkeys(unit for unit in units if isinstance(unit, Unit)))
        others = [unit for unit in units if unit and unit not in read]
        contradiction = [" and ".join(read)] if len(read) > 1 else []
        first: Unit | str = [*others, *contradiction, *read, *stated][0]
        return first
    if whole := _known(text):
        return whole
    if match := _LAST.fullmatch(text):
        after_sign, end = match[1].strip() in (",", "/", "in"), match[2]
        at_end = _known(end, one_letter=True) if len(end) > 1 or after_sign or end in _AT_END[of_time] else None
        if at_end and not _PREFIXES.isdisjoint(_words(text[: match.start(2)])[-1:]):
            return text
        if at_end := at_end or next(_of_kind(re.split(r"[\s_,.-]+", text), of_time), None):
            return at_end
    return text if _WITHIN.search(text) else None


def _words(text: str) -> list[str]:
    """The words of a name in small letters without accents, whatever stands between them."""
    plain = "".join(sign for sign in unicodedata.normalize("NFD", text.casefold()) if not unicodedata.combining(sign))
    return re.findall(r"[^\W\d_]+", plain)


def _of_kind(words: Iterable[str], of_time: bool) -> Iterator[Unit | str]:
    """The words among these that are units of time, or of force, in whatever capitals: of symbols others are others."""
    kind, others = (TimeUnit, _OTHER_TIMES) if of_time else (ForceUnit, _OTHER_FORCES)
    before = ""
    for word in words:
        unit = _known(word) if len(word) > 1 or word in _AT_END[of_time] else None
        other = len(word) > 1 and word.casefold() in (symbol.casefold() for symbol in kind)
        if isinstance(unit, kind) or other or word.casefold() in others:
            yield f"{before} {word}" if not _PREFIXES.isdisjoint(_words(before)[-1:]) else unit or word
        before = word


def remarked_units(line: str, *, of_time: bool) -> list[Unit | str]:
    """The units of time, or of force, in a line of the header: beside a word for unit, or in the brackets of a comment.

    Such as "Force unit: kgf", "# column 2: F [kgf]".

    >>> remarked_units("Units: ms, kgf", of_time=False), remarked_units("Load in kgf", of_time=False)
    (['kgf'], [])
    """
    if line.lstrip().startswith(("#", "%", "//")):
        texts = _BRACKETS.findall(_plain(line))
        if not of_time and (factors := [text for text in texts if _FACTOR.search(text)]):
            return [*factors]
        bracketed = (part for text in texts for part in re.split(r"[\s-]+", text.strip()))
        in_comment = list(_of_kind(bracketed, of_time))
        if in_comment:
            return in_comment
    if in_brackets(line):  # alone on its line
        return list(_of_kind([line.strip()[1:-1].strip()], of_time))
    unit_word = _UNIT_WORD.search(line)
    after = line[unit_word.end() :] if unit_word else ""
    if unit_word and not of_time and (factor := re.match(rf"[\s:=;,|]*({_TENFOLD}.*)", after)):
        return [factor[1]]
    if unit_word is None or re.search("[0-9]", after):  # "measuring unit for 5 kN" is no remark on units
        return []
    found = list(_of_kind(re.split(r"[\s,;:=|\t\"()\[\]-]+", _plain(line)), of_time))
    return [after.strip(" :=;,|\t")] if found and not _POWERS_OF_TEN.isdisjoint(_words(after)) else found


def spelled_otherwise(text: str, unit: Unit) -> bool:
    """Whether a text that states no unit that is read may still mean one: in other capitals, or grown onto a word.

    >>> spelled_otherwise("ForceNewton", ForceUnit.NEWTONS), spelled_otherwise("KN", ForceUnit.KILONEWTONS)
    (True, True)
    """
    words = [unit.value, *_SPELLINGS[unit].split()]
    return any(len(word) > 1 and word.casefold() in text.casefold() for word in words)


def _known(text: str, *, one_letter: bool = False) -> Unit | str | None:
    """A unit that is read, the text of a known other one, or None."""
    folded = text.casefold()
    if unit := _SYMBOLS.get(text) or _WORDS.get(folded):
        return unit
    if len(text) == 1:
        return text if one_letter and text in _ONE_LETTER else None
    if folded in _OTHERS | _FOLDED or text.startswith("%") or _WITH_ANOTHER.fullmatch(text):
        return text
    parts = [part.rstrip("0123456789²³-") for part in _PARTS.split(text)]
    composed = len(parts) > 1 or text[-1:] in ("²", "³")
    return text if composed and all(part and part != "t" and _known(part, one_letter=True) for part in parts) else None


def _plain(text: str) -> str:
    """One sign for micro, no blanks or quotes around."""
    return text.translate(_FULL_WIDTH | _DOTS).replace("μ", "µ").replace('"', " ").strip()


def in_brackets(text: str) -> bool:
    """True for a text in brackets and nothing else."""
    return _BRACKETS.fullmatch(text.strip()) is not None


def plain_unit(name: str, kind: type[Unit]) -> Unit | None:
    """The unit of a name that says time (or force) and its unit and nothing else: "time_ms", "t [s]", "Kraft (N)".

    >>> plain_unit("Zeit (ms)", TimeUnit), plain_unit("lag_ms", TimeUnit)
    (<TimeUnit.MILLISECONDS: 'ms'>, None)
    """
    match = _PLAIN.fullmatch(_plain(name))
    if match is None or (match[1] or match[3]).casefold() not in _PLAIN_WORDS[kind]:
        return None
    unit = _known(match[2] or match[4])
    return unit if isinstance(unit, kind) and unit is not ForceUnit.COUNTS else None
