#!/usr/bin/env python3
"""Licences of all that a package ships: what others have written, with the text under which they give it.

licences.py wheel WHEEL     adds them to a wheel, as THIRD_PARTY_LICENCES.txt beside its own
licences.py folder FOLDER   prints them for a folder that becomes a package

Nothing is listed by hand but where a text is, where no file says it. Fails where a shared library comes from nowhere, or the text
of anything is missing.
"""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEPS = ROOT / ".deps"
SITE = next(DEPS.glob("venv/lib/python3.*/site-packages"))
PREFIX = SITE / "cmeel.prefix"

OURS = re.compile(r"(bf|blockfactory-exists|_native\..*|lib(bf_|blockfactory|BlockFactory).*|(FMI|SharedMemory|Udp|WholeBody\w+)\.so)$")

# Wheels without a file of their licence: the header whose first comment is the licence, or a file that has it.
NOTICES = {
    "cmeel-assimp": PREFIX / "include/assimp/version.h",
    "cmeel-boost": PREFIX / "include/boost/outcome.hpp",
    "cmeel-console-bridge": PREFIX / "include/console_bridge/console.h",
    "cmeel-octomap": PREFIX / "include/octomap/octomap.h",
    "cmeel-qpoases": PREFIX / "include/qpOASES.hpp",
    "cmeel-tinyxml2": PREFIX / "include/tinyxml2.h",
    "cmeel-urdfdom": PREFIX / "include/urdfdom/urdf_parser/urdf_parser.h",
    "cmeel-urdfdom-headers": PREFIX / "include/urdfdom_headers/urdf_model/model.h",
    "cmeel-zlib": PREFIX / "share/doc/zlib/zlib/LICENSE",
}
# Wheels of which headers or archives are compiled in; Debian's are the development packages that the build installs.
COMPILED_IN = ["proxsuite", "cmeel-boost", "libpinocchio", "libcoal"]
ONLY_TESTS = {"libgtest-dev", "libbenchmark-dev", "libxml2-dev"}


class Missing(Exception):
    pass


def first_comment(text):
    """Of a header; a comment over lines that begin with // counts, too."""
    found = re.match(r"\s*(/\*.*?\*/|(?://[^\n]*\n)+)", text, re.DOTALL)
    if not found:
        raise Missing("it has no comment in front")
    lines = (re.sub(r"^\s*(/\*+|\*+/|\*|//)? ?|\*+/\s*$", "", line).rstrip() for line in found[1].splitlines())
    return "\n".join(lines).strip()


def of_wheel(name):
    folder = next(SITE.glob(f"{name.replace('-', '_')}-[0-9]*.dist-info"), None)
    if folder is None:
        raise Missing(f"there is no wheel {name} in .deps")
    files = sorted(file for file in folder.rglob("*") if re.match(r"LICEN[CS]|COPYING", file.name) and file.is_file())
    if files:
        return "\n\n".join(file.read_text() for file in files)
    if name not in NOTICES:
        raise Missing(f"the wheel {name} has no file of its licence; say in NOTICES of scripts/licences.py where it stands")
    text = NOTICES[name].read_text()
    if NOTICES[name].suffix in (".h", ".hpp"):
        text = first_comment(text)
    if "GNU Lesser General Public" in text:
        text += "\n\n" + pathlib.Path("/usr/share/common-licenses/LGPL-2.1").read_text()
    return text


def of_debian(package):
    file = pathlib.Path("/usr/share/doc") / package / "copyright"
    if not file.is_file():
        raise Missing(f"there is no {file}")
    text = file.read_text()
    # Debian has some texts once for all of its packages; a package that leaves Debian takes them along.
    named = sorted(set(re.findall(r"/usr/share/common-licenses/([\w.+-]*\w)", text)))
    return "\n\n".join([text] + [pathlib.Path("/usr/share/common-licenses", name).read_text() for name in named])


def of_sources(folder):
    files = sorted(file for file in folder.rglob("LICEN*") if "third_party" not in file.parts)
    if not files:
        raise Missing(f"{folder} has no file of its licence")
    return "\n\n".join(file.read_text() for file in files)


def owner_of(library):
    """The wheel or the Debian package that a shared library comes from, whatever auditwheel has called it."""
    name = re.sub(r"-[0-9a-f]{8}(?=\.)", "", library.name, count=1)
    stem = name.split(".so")[0] + ".so"
    for record in SITE.glob("*.dist-info/RECORD"):
        if re.search(rf"^[^\n]*/{re.escape(stem)}[.\w]*,", record.read_text(), re.MULTILINE):
            return "wheel", record.parent.name.split("-")[0].replace("_", "-")
    found = subprocess.run(["dpkg", "-S", f"*/{name}*"], capture_output=True, text=True).stdout
    packages = sorted({line.split(":")[0] for line in found.splitlines() if re.search(r"/lib\S*\.so", line)} - {""})
    runtime = [package for package in packages if not package.endswith("-dev")]
    if not runtime:
        raise Missing("no wheel in .deps and no package of Debian has it")
    return "debian", runtime[0]


def libraries(folder):
    for file in sorted(folder.rglob("*")):
        if file.is_file() and not file.is_symlink():
            with file.open("rb") as opened:
                if opened.read(4) == b"\x7fELF" and not OURS.match(file.name):
                    yield file


def page(folder):
    """What Vite says of the packages whose code is in the editor's page, and the font's; both are installed beside the page."""
    file = next(folder.rglob("share/blockfactory/page/licences.md"), None)
    text = file.read_text() if file else ""
    if "## svelte" not in text:
        raise Missing("the page has no licences.md in which svelte stands: Vite has not written it")
    return text + "\n\n" + (file.parent / "licence_of_the_font.txt").read_text()


def everything(folder):
    parts, missing = {}, []

    def add(name, text_of, *arguments):
        try:
            parts.setdefault(name, text_of(*arguments))
        except (Missing, OSError) as error:
            missing.append(f"{name}: {error}")

    for library in libraries(folder):
        try:
            kind, owner = owner_of(library)
        except Missing as error:
            missing.append(f"{library.relative_to(folder)}: {error}")
        else:
            add(f"{owner} ({'PyPI' if kind == 'wheel' else 'Debian'})", of_wheel if kind == "wheel" else of_debian, owner)
    for wheel in COMPILED_IN:
        add(f"{wheel} (PyPI)", of_wheel, wheel)
    for package in (ROOT / "apt-packages.txt").read_text().split():
        if package.endswith("-dev") and package not in ONLY_TESTS:
            add(f"{package} (Debian)", of_debian, package)
    for sources in sorted((DEPS / "src").iterdir()):
        if sources.is_dir():
            add(sources.name, of_sources, sources)
    if any(folder.rglob("_native.*.so")):
        add("nanobind", lambda: next(DEPS.glob("python/lib/python3.*/site-packages/nanobind-*.dist-info/licenses/LICENSE")).read_text())
    add("packages in the editor's page (npm)", page, folder)
    if missing:
        sys.exit("licences.py: what is shipped lacks a licence:\n  " + "\n  ".join(missing))
    line = "=" * 100
    listed = "\n".join(f"  {name}" for name in parts)
    return (f"BlockFactory is under the Apache License 2.0. This package holds work of others, whole or compiled in:\n\n{listed}\n\n"
            + "\n\n".join(f"{line}\n{name}\n{line}\n\n{text.strip()}" for name, text in parts.items()) + "\n")


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("wheel", "folder"):
        sys.exit(__doc__)
    what = pathlib.Path(sys.argv[2])
    if sys.argv[1] == "folder":
        print(everything(what), end="")
        return
    from auditwheel.wheeltools import InWheel

    with InWheel(what.resolve(), what.resolve()) as folder:
        folder = pathlib.Path(folder)
        licences = next(folder.glob("*.dist-info")) / "licenses"
        licences.mkdir(exist_ok=True)
        (licences / "THIRD_PARTY_LICENCES.txt").write_text(everything(folder))


if __name__ == "__main__":
    main()
