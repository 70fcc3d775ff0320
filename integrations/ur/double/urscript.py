"""A small interpreter of the URScript subset that feeler_robot.script uses: enough to run its very text.

Grammar: def, thread, end; global; assignments (names and elements); if/elif/else; while; return; calls; run, kill;
numbers, strings, True, False, lists, poses p[...]; + - * / comparisons, not, and, or; comments. Functions nest; names are
looked up from the inside out, and a name that an outer scope holds is assigned there, as the controller does it for
globals. Threads are Python generators: every primitive that takes time yields once a controller step, and all threads
advance together. What the script calls is given as `primitives`: name -> function (immediate) or generator function
(takes time).
"""
import re

_TOKEN = re.compile(r'\s*(?:(#[^\n]*)|(p\[)|(\d+\.?\d*(?:[eE][-+]?\d+)?)|("(?:[^"\\]|\\.)*")|([A-Za-z_]\w*)|(<=|>=|==|!=|[-+*/<>=(),\[\]:]))')


class ScriptError(Exception):
    """The script says something that this subset does not know."""


class Pose(list):
    """p[x, y, z, rx, ry, rz]."""


def _tokens(line, number):
    out, at = [], 0
    line = line.rstrip()
    while at < len(line):
        m = _TOKEN.match(line, at)
        if not m:
            raise ScriptError(f"line {number}: cannot read {line[at:]!r}")
        at = m.end()
        if m.group(1) is not None:
            break
        if m.group(2):
            out.append(("p[", "p["))
        elif m.group(3):
            text = m.group(3)
            out.append(("num", int(text) if text.isdigit() else float(text)))
        elif m.group(4):
            out.append(("str", m.group(4)[1:-1]))
        elif m.group(5):
            out.append(("name", m.group(5)))
        else:
            out.append(("op", m.group(6)))
    return out


class _Parser:
    """Expressions of one line."""

    def __init__(self, tokens, number):
        self.t, self.i, self.n = tokens, 0, number

    def peek(self):
        return self.t[self.i] if self.i < len(self.t) else ("end", None)

    def take(self, value=None):
        token = self.peek()
        if value is not None and token != ("op", value):
            raise ScriptError(f"line {self.n}: {value!r} expected, {token[1]!r} found")
        self.i += 1
        return token

    def done(self):
        if self.i != len(self.t):
            raise ScriptError(f"line {self.n}: {self.peek()[1]!r} is left over")

    def expression(self):
        left = self.conjunction()
        while self.peek() == ("name", "or"):
            self.take()
            left = ("or", left, self.conjunction())
        return left

    def conjunction(self):
        left = self.negation()
        while self.peek() == ("name", "and"):
            self.take()
            left = ("and", left, self.negation())
        return left

    def negation(self):
        if self.peek() == ("name", "not"):
            self.take()
            return ("not", self.negation())
        left = self.sum()
        if self.peek()[0] == "op" and self.peek()[1] in ("<", ">", "<=", ">=", "==", "!="):
            op = self.take()[1]
            return ("binary", op, left, self.sum())
        return left

    def sum(self):
        left = self.product()
        while self.peek() in (("op", "+"), ("op", "-")):
            op = self.take()[1]
            left = ("binary", op, left, self.product())
        return left

    def product(self):
        left = self.unary()
        while self.peek() in (("op", "*"), ("op", "/")):
            op = self.take()[1]
            left = ("binary", op, left, self.unary())
        return left

    def unary(self):
        if self.peek() == ("op", "-"):
            self.take()
            return ("minus", self.unary())
        value = self.atom()
        while self.peek() == ("op", "["):
            self.take()
            index = self.expression()
            self.take("]")
            value = ("index", value, index)
        return value

    def items(self, closing):
        items = []
        while self.peek() != ("op", closing):
            items.append(self.expression())
            if self.peek() == ("op", ","):
                self.take()
        self.take(closing)
        return items

    def atom(self):
        kind, value = self.take()
        if kind == "num" or kind == "str":
            return ("const", value)
        if kind == "p[":
            return ("pose", self.items("]"))
        if (kind, value) == ("op", "["):
            return ("list", self.items("]"))
        if (kind, value) == ("op", "("):
            inner = self.expression()
            self.take(")")
            return inner
        if kind == "name":
            if value in ("True", "False"):
                return ("const", value == "True")
            if value == "run":
                name = self.take()[1]
                self.take("(")
                self.take(")")
                return ("run", name)
            if self.peek() == ("op", "("):
                self.take()
                return ("call", value, self.items(")"))
            return ("name", value)
        raise ScriptError(f"line {self.n}: {value!r} is no value")


def parse(text):
    """The statements of a script."""
    lines = [(n, t) for n, t in ((n, _tokens(line, n)) for n, line in enumerate(text.split("\n"), 1)) if t]
    body, at = _block(lines, 0, ())
    if at != len(lines):
        raise ScriptError(f"line {lines[at][0]}: {lines[at][1][0][1]!r} ends nothing")
    return body


def _block(lines, at, closers):
    body = []
    while at < len(lines):
        number, t = lines[at]
        word = t[0][1] if t[0][0] == "name" else None
        if word in ("end", "elif", "else"):
            if word not in closers:
                raise ScriptError(f"line {number}: {word!r} ends nothing")
            return body, at
        if word in ("def", "thread"):
            parser = _Parser(t[1:], number)
            name = parser.take()[1]
            parser.take("(")
            names = [i[1] for i in parser.items(")")]
            parser.take(":")
            parser.done()
            inner, at = _block(lines, at + 1, ("end",))
            body.append((word, name, names, inner))
        elif word == "while":
            condition = _Parser(t[1:-1], number).expression()
            inner, at = _block(lines, at + 1, ("end",))
            body.append(("while", condition, inner))
        elif word == "if":
            branches = []
            while word in ("if", "elif"):
                condition = _Parser(lines[at][1][1:-1], lines[at][0]).expression()
                inner, at = _block(lines, at + 1, ("end", "elif", "else"))
                branches.append((condition, inner))
                word = lines[at][1][0][1]
            other = []
            if word == "else":
                other, at = _block(lines, at + 1, ("end",))
            body.append(("if", branches, other))
        elif word == "return":
            body.append(("return", _Parser(t[1:], number).expression() if len(t) > 1 else ("const", None)))
        elif word == "kill":
            body.append(("kill", t[1][1]))
        else:
            is_global = word == "global"
            parser = _Parser(t[1:] if is_global else t, number)
            left = parser.expression()
            if parser.peek() == ("op", "="):
                parser.take()
                right = parser.expression()
                body.append(("assign", is_global, left, right))
            else:
                body.append(("do", left))
            parser.done()
        at += 1
    if closers:
        raise ScriptError("the script ends before its 'end'")
    return body, at


class _Return(Exception):
    def __init__(self, value):
        self.value = value


class _Scope:
    def __init__(self, parent=None):
        self.names, self.parent = {}, parent

    def find(self, name):
        scope = self
        while scope is not None:
            if name in scope.names:
                return scope
            scope = scope.parent
        return None


class Interpreter:
    """Runs a script; `primitives`: name -> function, or generator function for what takes time (yields once a step)."""

    def __init__(self, text, primitives):
        self.body = parse(text)
        self.primitives = primitives
        self.threads = []  # generators, the main program first
        self.root = _Scope()

    def steps(self):
        """A generator that yields once a controller step, all threads advanced, until the main program ends."""
        main = self._run(self.body, self.root)
        self.threads = [main]
        while True:
            for thread in list(self.threads):
                if thread not in self.threads:
                    continue  # killed meanwhile
                try:
                    next(thread)
                except StopIteration:
                    self.threads.remove(thread)
                    if thread is main:
                        return
            yield

    def _run(self, body, scope):
        for statement in body:
            kind = statement[0]
            if kind in ("def", "thread"):
                scope.names[statement[1]] = (kind, statement[2], statement[3], scope)
            elif kind == "do":
                yield from self._value(statement[1], scope)
            elif kind == "assign":
                value = yield from self._value(statement[3], scope)
                if isinstance(value, list):
                    value = type(value)(value)  # by value, as the controller has it
                left = statement[2]
                if left[0] == "index":
                    target = yield from self._value(left[1], scope)
                    target[(yield from self._value(left[2], scope))] = value
                else:
                    holder = scope.find(left[1])
                    # A parameter or a name of the function itself comes first; `global` goes to where it was declared.
                    (holder or scope).names[left[1]] = value
            elif kind == "if":
                for condition, inner in statement[1]:
                    if (yield from self._value(condition, scope)):
                        yield from self._run(inner, scope)
                        break
                else:
                    yield from self._run(statement[2], scope)
            elif kind == "while":
                while (yield from self._value(statement[1], scope)):
                    yield from self._run(statement[2], scope)
            elif kind == "return":
                raise _Return((yield from self._value(statement[1], scope)))
            elif kind == "kill":
                holder = scope.find(statement[1])
                thread = holder.names[statement[1]]
                if thread in self.threads:
                    self.threads.remove(thread)
                    thread.close()

    def _call(self, function, arguments):
        _, names, body, defined_in = function
        scope = _Scope(defined_in)
        scope.names.update(zip(names, arguments))
        try:
            yield from self._run(body, scope)
        except _Return as returned:
            return returned.value
        return None

    def _value(self, e, scope):
        kind = e[0]
        if kind == "const":
            return e[1]
        if kind == "name":
            holder = scope.find(e[1])
            if holder is None:
                raise ScriptError(f"nobody knows {e[1]!r}")
            return holder.names[e[1]]
        if kind in ("list", "pose"):
            items = []
            for item in e[1]:
                items.append((yield from self._value(item, scope)))
            return items if kind == "list" else Pose(items)
        if kind == "index":
            value = yield from self._value(e[1], scope)
            return value[int((yield from self._value(e[2], scope)))]
        if kind == "minus":
            return -(yield from self._value(e[1], scope))
        if kind == "not":
            return not (yield from self._value(e[1], scope))
        if kind == "and":
            return (yield from self._value(e[1], scope)) and (yield from self._value(e[2], scope))
        if kind == "or":
            return (yield from self._value(e[1], scope)) or (yield from self._value(e[2], scope))
        if kind == "run":
            holder = scope.find(e[1])
            thread = self._call(holder.names[e[1]], [])
            self.threads.append(thread)
            return thread
        if kind == "call":
            arguments = []
            for item in e[2]:
                arguments.append((yield from self._value(item, scope)))
            holder = scope.find(e[1])
            if holder is not None:
                return (yield from self._call(holder.names[e[1]], arguments))
            primitive = self.primitives.get(e[1])
            if primitive is None:
                raise ScriptError(f"nobody knows {e[1]!r}")
            result = primitive(*arguments)
            if hasattr(result, "__next__"):
                return (yield from result)
            return result
        op = e[1]
        a = yield from self._value(e[2], scope)
        b = yield from self._value(e[3], scope)
        if op == "+":
            return a + b
        if op == "-":
            return a - b
        if op == "*":
            return a * b
        if op == "/":
            return a / b
        if op == "<":
            return a < b
        if op == ">":
            return a > b
        if op == "<=":
            return a <= b
        if op == ">=":
            return a >= b
        return a == b if op == "==" else a != b
