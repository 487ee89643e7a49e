"""mutations.py SOURCE: scripts/mutate finds the small faults of a source, and none in what is no code."""

import importlib.machinery
import importlib.util
import sys
from pathlib import Path

sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("mutate", str(Path(sys.argv[1]) / "scripts" / "mutate"))
mutate = importlib.util.module_from_spec(importlib.util.spec_from_loader("mutate", loader))
loader.exec_module(mutate)


def written(text):
    return [fault.about(text).split(": ", 1)[1] for fault in mutate.faults("a.cpp", text)]


def expect(found, wanted):
    assert found == wanted, f"{found}\nis not\n{wanted}"


expect(
    written("bool f(int a) {\n    return a < 0 && !g(a);\n}\n"),
    [
        "return a < 0 && !g(a);  ->  return a <= 0 && !g(a);",
        "return a < 0 && !g(a);  ->  return a >= 0 && !g(a);",
        "return a < 0 && !g(a);  ->  return a < 1 && !g(a);",
        "return a < 0 && !g(a);  ->  return a < 0 || !g(a);",
        "return a < 0 && !g(a);  ->  return a < 0 && g(a);",
    ],
)
expect(
    written("    x[i] = y;\n    go(a.b());\n    break;\n    return true;\n    z = std::max(u, v);\n"),
    [
        "x[i] = y;  ->  ;",
        "go(a.b());  ->  ;",
        "break;  ->  ;",
        "return true;  ->  return false;",
        "z = std::max(u, v);  ->  ;",
        "z = std::max(u, v);  ->  z = std::min(u, v);",
    ],
)
# Comments, texts, the preprocessor, templates, declarations, and memory that is only taken in advance.
expect(written("    list.reserve(a + 1);\n"), [])
expect(written('// a < b\n/* c && d\n   e */\n#if A == 1\n#define B \\\n    c + d\nauto s = "a < b" + t;\n'), [])
expect(written("template <class T> T f(const T& a, T&& b, std::vector<T>* c);\nstatic_assert(a == 1);\n"), [])
