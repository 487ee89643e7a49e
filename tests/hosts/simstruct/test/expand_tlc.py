#!/usr/bin/env python3
"""expand_tlc.py FILE.tlc RECORD.json CODE.cpp: what Simulink Coder would print.

Runs the part of the Target Language Compiler's documented language that BlockFactory.tlc uses, over the record that the
S-function wrote, and puts the printed code into a class of the shape that Simulink Coder generates. A name that the
record has not, or that nothing reads, is an error. RECORD.json:
    {"steps": n, "blocks": [{"name", "PWork": {name: width}, "settings": [{...}, ...],
                             "inputs": [{"dims", "type", "values"}], "outputs": [{"dims", "type"}]}]}
"""
import json
import math
import re
import sys

C_TYPES = ["double", "float", "signed char", "unsigned char", "short", "unsigned short", "int", "unsigned", "bool"]
TOKEN = re.compile(r'\s*(?:("(?:[^"\\]|\\.)*")|(\d+(?:\.\d+)?)|([A-Za-z_]\w*)|(\|\||&&|==|!=|[-+*/<>?:.,()\[\]]))')


class Record:
    """Fields of one record; remembers which were read."""

    def __init__(self, fields):
        self.fields, self.read = fields, set()

    def get(self, name):
        if name not in self.fields:
            raise NameError(f"the record has no {name}: {sorted(self.fields)}")
        self.read.add(name)
        return self.fields[name]


class Returned(Exception):
    def __init__(self, value):
        super().__init__()
        self.value = value


class Expression:
    """Evaluates one expression by precedence: ?: || && == > + * and what binds tighter."""
    LEVELS = [["||"], ["&&"], ["==", "!="], ["<", ">"], ["+", "-"], ["*", "/"]]

    def __init__(self, text, machine):
        self.machine, self.tokens, at = machine, [], 0
        while text[at:].strip():
            match = TOKEN.match(text, at)
            if not match:
                raise SyntaxError(f"cannot read {text[at:]!r}")
            self.tokens.append((match.lastindex, match.group(match.lastindex)))
            at = match.end()
        self.at = 0

    def peek(self):
        return self.tokens[self.at][1] if self.at < len(self.tokens) else None

    def take(self, wanted=None):
        token = self.tokens[self.at]
        if wanted is not None and token[1] != wanted:
            raise SyntaxError(f"{wanted!r} is missing before {token[1]!r}")
        self.at += 1
        return token

    def whole(self):
        value = self.conditional()
        if self.peek() is not None:
            raise SyntaxError(f"nothing can follow before {self.peek()!r}")
        return value

    def conditional(self):
        condition = self.binary(0)
        if self.peek() != "?":
            return condition
        self.take()
        first = self.conditional()
        self.take(":")
        second = self.conditional()
        return first if condition else second

    def binary(self, level):
        if level == len(self.LEVELS):
            return self.postfix()
        left = self.binary(level + 1)
        while self.peek() in self.LEVELS[level]:
            operator, right = self.take()[1], self.binary(level + 1)
            left = {"||": lambda a, b: bool(a) or bool(b), "&&": lambda a, b: bool(a) and bool(b),
                    "==": lambda a, b: a == b, "!=": lambda a, b: a != b, "<": lambda a, b: a < b,
                    ">": lambda a, b: a > b, "+": lambda a, b: a + b, "-": lambda a, b: a - b,
                    "*": lambda a, b: a * b, "/": lambda a, b: a / b}[operator](left, right)
        return left

    def arguments(self, end):
        values = []
        while self.peek() != end:
            values.append(self.conditional())
            if self.peek() == ",":
                self.take()
        self.take(end)
        return values

    def postfix(self):
        kind, token = self.take()
        if kind == 1:
            return self.machine.expand(re.sub(r"\\(.)", r"\1", token[1:-1]))
        if kind == 2:
            return float(token) if "." in token else int(token)
        if token == "[":
            return self.arguments("]")
        if token == "(":
            value = self.conditional()
            self.take(")")
            return value
        if kind != 3:
            raise SyntaxError(f"unexpected {token!r}")
        if self.peek() == "(":
            self.take()
            value = self.machine.call(token, self.arguments(")"))
        else:
            value = self.machine.look_up(token)
        while self.peek() in (".", "["):
            if self.take()[1] == ".":
                value = value.get(self.take()[1])
            else:
                index = self.conditional()
                self.take("]")
                if not isinstance(index, int):
                    raise TypeError(f"{index!r} is no index")
                value = value[index]
        return value


class Machine:
    """One block's view of the file."""

    def __init__(self, text, block):
        self.block, self.functions, self.scopes, self.out, self.includes = block, {}, [], [], []
        self.settings = [Record(fields) for fields in block["settings"]]
        lines, pending = [], ""
        for line in text.splitlines():
            if line.lstrip().startswith("%%"):
                continue
            line = pending + (line.strip() if pending else line)
            pending = ""
            if line.lstrip().startswith("%") and not line.lstrip().startswith("%<") and line.endswith("..."):
                pending = line[:-3]
            else:
                lines.append(line)
        body = None
        for line in lines:
            head = re.match(r"%function (\w+)\(([^)]*)\) (Output|void)$", line)
            if head:
                names = [name.strip() for name in head.group(2).split(",")]
                body = []
                self.functions[head.group(1)] = (names, head.group(3), body)
            elif line == "%endfunction":
                body = None
            elif body is not None:
                body.append(line)
            elif line.strip() and not line.startswith("%implements"):
                raise SyntaxError(f"outside a function: {line}")

    def look_up(self, name):
        if name in self.scopes[-1]:
            return self.scopes[-1][name]
        if len(self.scopes) > 1:
            raise NameError(f"there is no {name}: a function that another calls does not see the block")
        if name in self.block["PWork"]:
            return ("PWork", name)
        known = {"SFcnParamSettings": self.settings, "Type": "S-Function", "Name": "block"}
        if name not in known:
            raise NameError(f"there is no {name}")
        return known[name]

    def evaluate(self, text):
        return Expression(text, self).whole()

    def expand(self, text):
        """Replaces each %<expression>, which ends at the first > outside texts and parentheses."""
        result, at = "", 0
        while (start := text.find("%<", at)) >= 0:
            depth, in_text, end = 0, False, start + 2
            while in_text or depth or text[end] != ">":
                in_text ^= text[end] == '"'
                depth += 0 if in_text else (text[end] in "([") - (text[end] in ")]")
                end += 1
            value = self.evaluate(text[start + 2:end])
            result += text[at:start] + (value if isinstance(value, str) else repr(value))
            at = end + 1
        return result + text[at:]

    def run(self, name, values):
        names, kind, body = self.functions[name]
        if len(names) != len(values):
            raise TypeError(f"{name} takes {names}")
        self.scopes.append(dict(zip(names, values)))
        try:
            self.statements(body, 0, len(body), kind == "Output")
            return ""
        except Returned as returned:
            return returned.value
        finally:
            self.scopes.pop()

    def matching(self, body, begin, opens, closes):
        """Lines of the directives at this depth from `opens` on, the last of which closes."""
        depth, found = 0, []
        for i in range(begin, len(body)):
            word = body[i].split()[0] if body[i].split() else ""
            depth += word == opens
            if depth == 1 and (i == begin or word in closes):
                found.append(i)
            if word == closes[-1]:
                depth -= 1
                if depth == 0:
                    return found
        raise SyntaxError(f"{opens} does not end")

    def statements(self, body, begin, end, prints):
        i = begin
        while i < end:
            line = body[i].strip()
            word, _, rest = line.partition(" ")
            if word == "%assign":
                name, _, expression = rest.partition("=")
                self.scopes[-1][name.strip()] = self.evaluate(expression)
            elif word == "%return":
                raise Returned(self.evaluate(rest) if rest else "")
            elif word == "%foreach":
                last = self.matching(body, i, "%foreach", ["%endforeach"])[-1]
                name, _, count = rest.partition("=")
                for k in range(self.evaluate(count)):
                    self.scopes[-1][name.strip()] = k
                    self.statements(body, i + 1, last, prints)
                i = last
            elif word == "%if":
                marks = self.matching(body, i, "%if", ["%elseif", "%else", "%endif"])
                for mark, following in zip(marks, marks[1:]):
                    branch, _, condition = body[mark].strip().partition(" ")
                    if branch == "%else" or self.evaluate(condition):
                        self.statements(body, mark + 1, following, prints)
                        break
                i = marks[-1]
            elif line.startswith("%") and not line.startswith("%<"):
                raise SyntaxError(f"unknown directive: {line}")
            else:
                text = self.expand(body[i])
                if prints:
                    self.out.append(text)
                elif text.strip():
                    raise SyntaxError(f"a function that prints nothing has the text {text}")
            i += 1

    def call(self, name, values):
        if name in self.functions:
            return self.run(name, values)
        port = lambda side: self.block[side][values[0]]
        dims = lambda side: port(side)["dims"]
        memory = lambda side: f"&{self.block['name']}_{side[0]}{values[0]}[0]"
        if name == "LibBlockPWork":
            (_, vector), index = values[0], values[3]
            if index >= self.block["PWork"][vector]:
                raise IndexError(f"{vector} has no element {index}")
            return f"{self.block['name']}_PWORK.{vector}[{index}]"
        known = {
            "ISNAN": lambda: math.isnan(values[0]),
            "ISINF": lambda: math.isinf(values[0]),
            "SIZE": lambda: [1, len(values[0])][values[1]],
            "CAST": lambda: {"Number": int}[values[0]](values[1]),
            "LibAddToCommonIncludes": lambda: self.includes.append(values[0]) or "",
            "LibSetRTModelErrorStatus": lambda: f"M_M.errorStatus = ({values[0]})",
            "LibBlockNumInputPorts": lambda: len(self.block["inputs"]),
            "LibBlockNumOutputPorts": lambda: len(self.block["outputs"]),
            "LibBlockInputSignalDimensions": lambda: dims("inputs"),
            "LibBlockOutputSignalDimensions": lambda: dims("outputs"),
            "LibBlockInputSignalDataTypeId": lambda: port("inputs")["type"],
            "LibBlockOutputSignalDataTypeId": lambda: port("outputs")["type"],
            "LibBlockInputSignalAddr": lambda: memory("inputs"),
            "LibBlockOutputSignalAddr": lambda: memory("outputs"),
        }
        if name not in known:
            raise NameError(f"there is no function {name}")
        return known[name]()

    def printed(self, function):
        self.out = []
        self.run(function, [None, None])
        return "\n".join(self.out)


def number_of(fields):
    """JSON has no infinity and no NaN: they are {"float": text}."""
    return float(fields["float"]) if "float" in fields else fields


def main(tlc, record, code):
    text, model = open(tlc).read(), json.load(open(record), object_hook=number_of)
    includes, members = [], []
    printed = {name: [] for name in ("Start", "Outputs", "Update", "Terminate")}
    for block in model["blocks"]:
        machine = Machine(text, block)
        machine.printed("BlockTypeSetup")
        includes += [header for header in machine.includes if header not in includes]
        for function, all_code in printed.items():
            all_code.append(machine.printed(function))
        for settings in machine.settings:
            unread = set(settings.fields) - settings.read
            # Which of the two says how long a value is depends on its kind.
            if unread - {"texts", "values", "lengths", "value"}:
                raise NameError(f"nothing reads {sorted(unread)}")
        name = block["name"]
        for vector, width in block["PWork"].items():
            members.append(f"  struct {{ void* {vector}[{width}]; }} {name}_PWORK = {{}};")
        for side in ("inputs", "outputs"):
            for i, port in enumerate(block[side]):
                values = ", ".join(map(repr, port.get("values", [])))
                members.append(f"  {C_TYPES[port['type']]} {name}_{side[0]}{i}[{math.prod(port['dims'])}] = {{{values}}};")
    show = "\n".join(f"    for (const auto y : model.model()->{block['name']}_o{i}) std::printf(\"%.17g\\n\", double(y));"
                     for block in model["blocks"] for i in range(len(block["outputs"])))
    methods = "\n".join(f"  void {method}() {{\n{chr(10).join(sum((printed[f] for f in functions), []))}\n  }}"
                        for method, functions in {"initialize": ["Start"], "step": ["Outputs", "Update"],
                                                  "terminate": ["Terminate"]}.items())
    with open(code, "w") as file:
        file.write("\n".join(f"#include {header}" for header in includes) + f"""
#include <BlockFactory/SimulinkCoder/GeneratedCodeWrapper.h>

struct MModelClass {{
  struct {{ const char* errorStatus; }} M_M = {{}};
  auto* getRTM() {{ return &M_M; }}
{chr(10).join(members)}
{methods}
}};

int main() {{
  blockfactory::coder::GeneratedCodeWrapper<MModelClass> model;
  bool good = model.initialize();
  for (const auto& block : model.parameters()) std::printf("block %s\\n", block.first.c_str());
  for (int step = 0; good && step < {model["steps"]}; ++step) {{
    good = model.step();
    if (!good) break;
{show}
  }}
  const bool ran = good;
  if (!good) std::printf("%s\\n", model.getErrors().c_str());
  good = model.terminate();
  if (ran && !good) std::printf("%s\\n", model.getErrors().c_str());
  return ran && good ? 0 : 1;
}}
""")


main(*sys.argv[1:])
