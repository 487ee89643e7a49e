"""What headers promise, as libclang reads them: declarations that users see, and layouts that two binaries share."""

import pathlib

import clang.cindex as clang

# The shared library of Debian's clang-14; the bindings alone would look for the one of its development package.
LIBRARY = pathlib.Path("/usr/lib/llvm-14/lib/libclang.so.1")
if LIBRARY.exists():
    clang.Config.set_library_file(str(LIBRARY))

Kind, Access = clang.CursorKind, clang.AccessSpecifier
RECORDS = (Kind.CLASS_DECL, Kind.STRUCT_DECL, Kind.UNION_DECL)
FUNCTIONS = (Kind.FUNCTION_DECL, Kind.CXX_METHOD, Kind.CONSTRUCTOR, Kind.CONVERSION_FUNCTION, Kind.FUNCTION_TEMPLATE)
ALSO = (Kind.FIELD_DECL, Kind.VAR_DECL, Kind.TYPE_ALIAS_DECL, Kind.TYPEDEF_DECL)


def parse(headers, folders):
    """One unit that includes the headers; folders are where those and what they include are searched."""
    text = "".join(f"#include <{header}>\n" for header in headers)
    unit = clang.Index.create().parse(
        "all.cpp",
        ["-std=c++20", "-DEIGEN_MAX_ALIGN_BYTES=16", "-DEIGEN_MALLOC_ALREADY_ALIGNED=1", "-isystem", "/usr/include/eigen3",
         *(f"-I{folder}" for folder in folders)],
        unsaved_files=[("all.cpp", text)],
        options=clang.TranslationUnit.PARSE_SKIP_FUNCTION_BODIES,
    )
    errors = [str(message) for message in unit.diagnostics if message.severity >= clang.Diagnostic.Error]
    if errors:
        raise SystemExit("the headers do not compile:\n" + "\n".join(errors[:10]))
    return unit


def is_in(cursor, folders):
    file = cursor.location.file
    return file is not None and any(pathlib.Path(file.name).is_relative_to(folder) for folder in folders)


def declarations(unit, folders):
    """All that users may name of the headers in `folders`, but for namespaces `detail`: a line each."""
    lines = set()

    def walk(parent, scope):
        for cursor in parent.get_children():
            if cursor.access_specifier == Access.PRIVATE:
                continue
            name = f"{scope}{cursor.displayname}"
            if cursor.kind == Kind.NAMESPACE:
                if cursor.spelling not in ("detail", ""):
                    walk(cursor, f"{scope}{cursor.spelling}::")
            elif not is_in(cursor, folders):
                continue
            elif cursor.kind in RECORDS or cursor.kind in (Kind.CLASS_TEMPLATE, Kind.ENUM_DECL):
                if cursor.is_definition() and cursor.spelling:
                    lines.add(f"type {name}")
                    walk(cursor, f"{name}::")
            elif cursor.kind == Kind.CXX_BASE_SPECIFIER:
                lines.add(f"base of {scope.removesuffix('::')}: {cursor.type.spelling}")
            elif cursor.kind == Kind.ENUM_CONSTANT_DECL:
                lines.add(f"value {name} = {cursor.enum_value}")
            elif cursor.kind in FUNCTIONS:
                virtual = "virtual " if cursor.is_virtual_method() else ""
                lines.add(f"{virtual}function {name}: {cursor.type.spelling}")
            elif cursor.kind in ALSO:
                lines.add(f"{'member' if cursor.kind == Kind.FIELD_DECL else 'name'} {name}: {cursor.type.spelling}")

    walk(unit.cursor, "")
    return lines


def layouts(unit, folders, only=None):
    """Of the records that are no templates: sizes, where each member lies, and the order of virtual methods. An enumeration
    counts with its values. `only`: those of that name."""
    lines = set()

    def add(cursor, name):
        fields = [f"{field.spelling} @{field.get_field_offsetof() // 8} {field.type.spelling}"
                  for field in cursor.type.get_fields()]
        methods = [f"{method.spelling}: {method.type.spelling}" for method in cursor.get_children()
                   if method.kind in (Kind.CXX_METHOD, Kind.DESTRUCTOR) and method.is_virtual_method()]
        bases = [base.type.spelling for base in cursor.get_children() if base.kind == Kind.CXX_BASE_SPECIFIER]
        lines.add(f"layout {name} size {cursor.type.get_size()} align {cursor.type.get_align()}"
                  + "".join(f"; base {base}" for base in bases) + "".join(f"; {field}" for field in fields)
                  + "".join(f"; virtual {method}" for method in methods))

    def walk(parent, scope):
        for cursor in parent.get_children():
            name = f"{scope}{cursor.displayname or cursor.type.spelling}" # of C's: typedef struct {...} NAME
            if cursor.kind == Kind.NAMESPACE or cursor.kind == Kind.LINKAGE_SPEC or cursor.kind == Kind.UNEXPOSED_DECL:
                walk(cursor, f"{scope}{cursor.spelling}::" if cursor.spelling else scope)
            elif not is_in(cursor, folders) or not cursor.is_definition():
                continue
            elif cursor.kind in RECORDS:
                if cursor.type.get_size() > 0 and "(" not in name and (only is None or name in only):
                    add(cursor, name)
                walk(cursor, f"{name}::")
            elif cursor.kind == Kind.ENUM_DECL and (only is None or name in only):
                lines.update(f"value {name}::{value.spelling} = {value.enum_value}" for value in cursor.get_children()
                             if value.kind == Kind.ENUM_CONSTANT_DECL)

    walk(unit.cursor, "")
    return lines
