"""Small interpreters for the parts of URScript and KRL that exported files use; anything else is an error."""

from __future__ import annotations

import ast
import math
import operator
import re

OPERATORS = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Eq: operator.eq, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip


class Frame(dict):
    """A KRL FRAME: components by name."""


def square_root(value):
    return math.sqrt(value) if value >= 0 else math.nan


def evaluate(node, names):
    """An expression of numbers, names, lists, indices, components, sqrt, comparisons and `and`."""
    match node:
        case ast.Expression(body=body):
            return evaluate(body, names)
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return names[name]
        case ast.List(elts=items):
            return [evaluate(item, names) for item in items]
        case ast.Tuple(elts=items):
            return tuple(evaluate(item, names) for item in items)
        case ast.BinOp(left=left, op=op, right=right):
            return OPERATORS[type(op)](evaluate(left, names), evaluate(right, names))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return OPERATORS[type(op)](evaluate(left, names), evaluate(right, names))
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=value)):  # the sign of a number
            return -value
        case ast.BoolOp(op=ast.And(), values=values):
            found = [evaluate(value, names) for value in values]  # both sides, as KRL does
            return all(found)
        case ast.Subscript(value=value, slice=index):
            found, at = evaluate(value, names), evaluate(index, names)
            assert isinstance(found, dict) or 0 <= at < len(found)
            return found[at]
        case ast.Attribute(value=value, attr=name):
            return evaluate(value, names)[name]
        case ast.Call(func=ast.Name(id="sqrt" | "SQRT"), args=[argument]):
            return square_root(evaluate(argument, names))
        case ast.Call(func=ast.Name(id=name), args=arguments) if callable(names.get(name)):
            return names[name](*(evaluate(argument, names) for argument in arguments))
    raise AssertionError(f"not in the subset: {ast.dump(node)}")


def expression(text, names):
    return evaluate(ast.parse(text.strip(), mode="eval"), names)


def run_block(lines, names, patterns):
    """Run statements; `patterns` are (if, while, end, assignment, return, ignored). Gives the returned value."""
    opens, loops, ends, assigns, returns, ignored = (re.compile(pattern) for pattern in patterns)

    def end_of(start):
        depth = 0
        for at in range(start, len(lines)):
            depth += bool(opens.fullmatch(lines[at]) or loops.fullmatch(lines[at]))
            depth -= bool(ends.fullmatch(lines[at]))
            if depth == 0:
                return at
        raise AssertionError("a block without an end")

    at = 0
    while at < len(lines):
        line = lines[at]
        if found := opens.fullmatch(line):
            if not expression(found[1], names):
                at = end_of(at)
        elif found := loops.fullmatch(line):
            end = end_of(at)
            for _ in range(100_000):
                if not expression(found[1], names):
                    break
                assert run_block(lines[at + 1 : end], names, patterns) is None
            at = end
        elif found := assigns.fullmatch(line):
            owner, _, part = found[1].rpartition(".")
            (names[owner] if owner else names)[part] = expression(found[2], names)
        elif found := returns.fullmatch(line):
            return expression(found[1], names)
        else:
            assert ends.fullmatch(line) or ignored.fullmatch(line), f"not in the subset: {line!r}"
        at += 1
    return None


def urscript_function(text, name):
    """The function of that name, the only one in a URScript file, as a Python function of one argument."""
    return urscript_program(text, f"def {name}(pose):", {}, "pose")


def urscript_program(text, head, names, *parameters):
    """The function with that head, the only one in a text of URScript, with other names that it may use."""
    lines = [line.split("#")[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    assert [line for line in lines if line.startswith("def ")] == [head]
    assert lines[0] == head
    body = lines[1:]
    assert body[-1] == "end"
    patterns = (
        r"if (.*):", r"while (.*):", r"end", r"(?:local )?(\w+) = (.*)", r"return (.*)", r"(?!)",
    )  # fmt: skip
    return lambda *given: run_block(body[:-1], names | dict(zip(parameters, given, strict=True)), patterns)


def urscript_along_function(text):
    """The function `forcemap_speed_along` of a URScript file, the only one."""
    head = "def forcemap_speed_along(start, target, tool):"
    return urscript_program(text, head, {}, "start", "target", "tool")


def example_in_head(text, mark):
    """The lines of a program's head that say how to ask it: those of words, and those of program between them."""
    comments = [line.removeprefix(mark)[1:] for line in text.splitlines() if line.startswith(mark)]
    lines = comments[[line.startswith("how to ask it") for line in comments].index(True) :]
    code = [line.strip() for line in lines if line.startswith("  ") and "only then" not in line]
    return [line for line in lines if line.strip() not in code], code


def urscript_example(text, here, there, names):
    """The least speed on the way from here to there, as the head of a URScript file asks for it."""
    _, code = example_in_head(text, "#")
    program = "\n".join(["def example(there):", *code, "return v", "end"])
    return urscript_program(program, "def example(there):", names | {"get_actual_tcp_pose": lambda: here}, "there")(
        there
    )


def krl_example(text, here, there, names):
    """The least speed on the way from here to there, as the head of a KRL file asks for it."""
    _, code = example_in_head(text, ";")
    patterns = (r"IF (.*) THEN", r"WHILE (.*)", r"ENDIF|ENDWHILE", r"([\w.]+) = (.*)", r"RETURN (.*)", r"(?!)")
    given = names | {"HERE": here, "TARGET": there, "NULLFRAME": Frame.fromkeys("XYZ", 0.0)}
    return run_block([line.replace("$", "") for line in [*code, "RETURN V"]], given, patterns)


def krl_arrays(text):
    """Arrays of a KRL data list, as dictionaries from index (counted from 1) to number."""
    lines = [line.split(";")[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    assert lines[0] == "DEFDAT FORCEMAP PUBLIC"
    assert lines[-1] == "ENDDAT"
    arrays, sizes = {}, {}
    for line in lines[1:-1]:
        if found := re.fullmatch(r"DECL GLOBAL (?:REAL|INT) (\w+)\[([\d,]+)\]", line):
            arrays[found[1]], sizes[found[1]] = {}, math.prod(map(int, found[2].split(",")))
        else:
            found = re.fullmatch(r"(\w+)\[([\d,]+)\]=([\d.-]+)", line)
            index = tuple(map(int, found[2].split(",")))
            number = float(found[3]) if "." in found[3] else int(found[3])
            arrays[found[1]][index[0] if len(index) == 1 else index] = number
    assert {name: len(array) for name, array in arrays.items()} == sizes
    return arrays


def krl_along(source, data):
    """The function FORCEMAP_ALONG of a KRL source file, as a Python function of two frames and a number."""
    return krl_function(source, data, "FORCEMAP_ALONG", ("P", "Q", "TOOL"))


def krl_function(source, data, name, parameters=("P",)):
    """The function of that name in a KRL source file, as a Python function of a frame, or more."""
    lines = [line.split(";")[0].strip() for line in source.splitlines()]
    lines = [line for line in lines if line]
    start = lines.index(f"GLOBAL DEFFCT REAL {name}({', '.join(f'{each}:IN' for each in parameters)})")
    assert lines[:start] == ["DEF FORCEMAP()", "END"]
    assert sum("DEF" in line.split()[:2] or "DEFFCT" in line.split()[:2] for line in lines) == 2
    assert lines[-1] == "ENDFCT"
    body = [re.sub(r"\bAND\b", "and", line) for line in lines[start + 1 : lines.index("ENDFCT")]]
    patterns = (
        r"IF (.*) THEN", r"WHILE (.*)", r"ENDIF|ENDWHILE", r"(\w+) = (.*)", r"RETURN (.*)", r"DECL (FRAME|REAL|INT) .*",
    )  # fmt: skip
    arrays = krl_arrays(data)
    return lambda *given: run_block(body, dict(zip(parameters, given, strict=True)) | arrays, patterns)
