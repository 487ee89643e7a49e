// The model for other languages: a C interface and a Python module over it.
#include "c_language.hpp"
#include "generator.hpp"

#include "bf/core/hash.hpp"

#include <span>

namespace bf::codegen {

namespace {

std::string note_on(const Field& field, bool is_dynamic) {
    const Slot& slot = *field.slot;
    const bool is_matrix = slot.size.cols != 1 && !is_dynamic;
    return about(field.path +
                     (is_matrix ? ", " + number(slot.size.rows) + " x " + number(slot.size.cols) : ""),
                 field.unit, field.doc);
}

bool is_scalar(const Slot& slot) { return slot.size.count() == 1 && slot.size.cols == 1; }

const char* ctypes_name(Type type) {
    constexpr const char* names[] = {"c_double", "c_float", "c_int8",   "c_uint8", "c_int16",
                                     "c_uint16", "c_int32", "c_uint32", "c_bool"};
    return names[static_cast<std::size_t>(type)];
}

constexpr const char* c_functions = R"~(/* A new model; null without memory. */
@prefix@_model* @prefix@_create(void);
void @prefix@_destroy(@prefix@_model* model);

/* Initial states; needed before the first step, and to begin anew. False: see @prefix@_failure. */
bool @prefix@_initialize(@prefix@_model* model);
/* One period. False when the step failed; it then fails until @prefix@_initialize. */
bool @prefix@_step(@prefix@_model* model);
/* The two halves of a step. Between them @prefix@_get reads the signals of the step; after it continuous ones may be those of
   the solver's last stage. */
bool @prefix@_output(@prefix@_model* model);
bool @prefix@_update(@prefix@_model* model);
@rates@void @prefix@_terminate(@prefix@_model* model);

double @prefix@_period(void);                         /* of a step [s] */
double @prefix@_time(const @prefix@_model* model); /* of the next step [s] */
/* Which block failed, and why; null when none did. */
const char* @prefix@_failed_block(const @prefix@_model* model);
const char* @prefix@_failure(const @prefix@_model* model);

/* Changes a parameter or variable between two steps: all elements, column by column, or one that expands. Null, or what is wrong;
   nothing changes then. */
const char* @prefix@_set_parameter(@prefix@_model* model, const char* name, const double* values, int count);
/* Several parameters and variables together, all or none. What follows from a variable changes with it. */
typedef struct {
    const char* name;
    const double* values;
    int count;
} @prefix@_value;
const char* @prefix@_set_parameters(@prefix@_model* model, const @prefix@_value* changes, int count);
/* Reads at most `capacity` elements of a parameter, variable or recorded signal; gives how many it has, -1 when there is none of
   that name. */
int @prefix@_get(const @prefix@_model* model, const char* name, double* values, int capacity);
)~";

constexpr const char* c_source = R"~(
struct @prefix@_model : @Class@ {
    std::string wrong@folder_member@; // with the parameter file
};

extern "C" {

@prefix@_model* @prefix@_create(void) { return new (std::nothrow) @prefix@_model(); }
void @prefix@_destroy(@prefix@_model* model) { delete model; }
bool @prefix@_initialize(@prefix@_model* model) { return model->initialize(); }
bool @prefix@_step(@prefix@_model* model) { return model->step(); }
bool @prefix@_output(@prefix@_model* model) { return model->output(); }
bool @prefix@_update(@prefix@_model* model) { return model->update(); }
@rates_of_source@void @prefix@_terminate(@prefix@_model* model) { model->terminate(); }
double @prefix@_period(void) { return @Class@::period; }
double @prefix@_time(const @prefix@_model* model) { return model->time(); }
const char* @prefix@_failed_block(const @prefix@_model* model) { return model->failed_block(); }
const char* @prefix@_failure(const @prefix@_model* model) { return model->failure(); }
const char* @prefix@_set_parameter(@prefix@_model* model, const char* name, const double* values, int count) {
    return model->set_parameter(name, values, count);
}
static_assert(sizeof(@prefix@_value) == sizeof(bf::generated::NewValue), "one layout");
const char* @prefix@_set_parameters(@prefix@_model* model, const @prefix@_value* changes, int count) {
    return model->set_parameters(reinterpret_cast<const bf::generated::NewValue*>(changes), count);
}
int @prefix@_get(const @prefix@_model* model, const char* name, double* values, int capacity) {
    const bf::generated::Quantity* quantity = model->find_parameter(name);
    if (!quantity) quantity = model->recorded_table().find(name);
    if (!quantity) return -1;
    for (int i = 0; i < quantity->size() && i < capacity; ++i)
        values[i] = bf::generated::read(model->data(*quantity), quantity->type, i);
    return quantity->size();
}
)~";

constexpr const char* c_load =
    R"~(/* Takes the values of a parameter file, as the program does with --params; arguments of blocks before the first
   @prefix@_initialize. "": none. Null, or what is wrong, until the next call; nothing changes then. */
const char* @prefix@_load_parameters(@prefix@_model* model, const char* file);
)~";

constexpr const char* c_load_source =
    R"~(const char* @prefix@_load_parameters(@prefix@_model* model, const char* file) {
    model->wrong = *file ? bf::generated::load_parameters(*model, file) : "";
    return model->wrong.empty() ? nullptr : model->wrong.c_str();
}
)~";

constexpr const char* c_elaborate =
    R"~(/* Finds sizes and memory with the values of a parameter file, as `bf run --params` takes it; null: with none. Null, or what is
   wrong, until the next call. @prefix@_initialize does it without a file, if nobody did; `data` of inputs and outputs is null before. */
const char* @prefix@_elaborate(@prefix@_model* model, const char* parameter_file);
)~";

constexpr const char* c_elaborate_source =
    R"~(const char* @prefix@_elaborate(@prefix@_model* model, const char* parameter_file) {
    model->wrong = model->elaborate(parameter_file ? parameter_file : "");
    return model->wrong.empty() ? nullptr : model->wrong.c_str();
}
)~";

constexpr const char* c_folder =
    R"~(/* Where relative file names of blocks are meant from, instead of the model's folder; before all that follows creation. */
void @prefix@_set_folder(@prefix@_model* model, const char* folder);
)~";

constexpr const char* c_folder_source =
    R"~(void @prefix@_set_folder(@prefix@_model* model, const char* folder) {
    model->own_folder = folder;
    model->folder = model->own_folder.c_str();
}
)~";

constexpr const char* python_head = R"~(import ctypes
import keyword
import os
import pathlib

_library = ctypes.CDLL(
    os.environ.get("@Class@_LIBRARY", str(pathlib.Path(__file__).resolve().with_name("lib@prefix@.so")))
)


def _fields(*fields):
    return [(name + "_" if keyword.iskeyword(name) else name, kind) for name, kind in fields]
)~";

constexpr const char* python_dynamic = R"~(

def _quantity(kind):
    members = [("data", ctypes.POINTER(kind)), ("rows", ctypes.c_int), ("cols", ctypes.c_int)]
    return type("Quantity", (ctypes.Structure,), {"_fields_": members})


class _Arrays:
    """The quantities of a structure, each an array of its elements. One number, when set, is all of them."""

    def __init__(self, structure):
        for name, _ in structure._fields_:
            quantity = getattr(structure, name)
            array = quantity.data._type_ * (quantity.rows * quantity.cols)
            self.__dict__[name] = (
                ctypes.cast(quantity.data, ctypes.POINTER(array)).contents if quantity.data else array()
            )

    def __setattr__(self, name, values):
        array = getattr(self, name)
        array[:] = [values] * len(array) if isinstance(values, (int, float)) else values
)~";

constexpr const char* python_folder =
    R"~(        if folder:
            _function("set_folder", None, _model, _text)(self._model, os.fsencode(folder))
)~";

constexpr const char* python_class = R"~(

def _function(name, result, *arguments):
    function = getattr(_library, "@prefix@_" + name)
    function.restype, function.argtypes = result, arguments
    return function


_model, _text, _doubles = ctypes.c_void_p, ctypes.c_char_p, ctypes.POINTER(ctypes.c_double)
_create = _function("create", _model)
_destroy = _function("destroy", None, _model)
_initialize = _function("initialize", ctypes.c_bool, _model)
_step = _function("step", ctypes.c_bool, _model)
_output = _function("output", ctypes.c_bool, _model)
_update = _function("update", ctypes.c_bool, _model)
_terminate = _function("terminate", None, _model)
_time = _function("time", ctypes.c_double, _model)
_failed_block = _function("failed_block", _text, _model)
_failure = _function("failure", _text, _model)


class _Value(ctypes.Structure):
    _fields_ = [("name", _text), ("values", _doubles), ("count", ctypes.c_int)]


_set_parameters = _function("set_parameters", _text, _model, ctypes.POINTER(_Value), ctypes.c_int)
_get = _function("get", ctypes.c_int, _model, _text, _doubles, ctypes.c_int)


class @Class@:
    """One running model. RuntimeError names the block that fails."""

    period = _function("period", ctypes.c_double)()

    def __init__(self, parameters=""@folder_argument@):
        """With the values of a parameter file, as the program takes it with --params.@folder_doc@"""
        self._model = _create()
        if not self._model:
            raise MemoryError("@Class@")
@set_folder@        wrong = _function("@load@", _text, _model, _text)(self._model, os.fsencode(parameters))
        if wrong:
            raise ValueError(wrong.decode().rstrip())
@structures@        self.initialize()

    def __del__(self):
        if getattr(self, "_model", None):
            _terminate(self._model)
            _destroy(self._model)

    def _check(self, good):
        if not good:
            raise RuntimeError(f"{_failed_block(self._model).decode()}: {_failure(self._model).decode()}")

    def initialize(self):
        """Begins anew."""
        self._check(_initialize(self._model))

    def step(self):
        """One period."""
        self._check(_step(self._model))

    def output(self):
        """The first half of a step. Afterwards `get` reads its signals; after the step continuous ones may be those of
        the solver's last stage."""
        self._check(_output(self._model))

    def update(self):
        """The second half of a step."""
        self._check(_update(self._model))

    @property
    def time(self):
        """Of the next step [s]."""
        return _time(self._model)

    def set_parameter(self, name, values):
        """Of a parameter or variable: all elements, column by column, or one that expands. ValueError says what is
        wrong; nothing changes then."""
        self.set_parameters({name: values})

    def set_parameters(self, changes):
        """Several by name, all or none. What follows from a variable changes with it."""
        names, rows = [], []
        for name, values in changes.items():
            values = [values] if isinstance(values, (int, float)) else list(values)
            array = (ctypes.c_double * len(values))(*values)
            names.append(name)
            rows.append(_Value(name.encode(), array, len(values)))
        wrong = _set_parameters(self._model, (_Value * len(rows))(*rows), len(rows))
        if wrong:
            raise ValueError(f"{', '.join(names)}: {wrong.decode()}")

    def get(self, name):
        """A parameter, variable or recorded signal, as a list."""
        size = _get(self._model, name.encode(), None, 0)
        if size < 0:
            raise KeyError(name)
        values = (ctypes.c_double * size)()
        _get(self._model, name.encode(), values, size)
        return list(values)
)~";

} // namespace

std::string Generator::c_structure(const char* name, const char* doc,
                                   const std::vector<Field>& fields) const {
    std::string text = std::string("/* ") + doc + " */\ntypedef struct {\n";
    for (const auto& field : fields) {
        const std::string type = c_name(type_of(*field.slot));
        text += "    " +
                (is_dynamic() ? "struct { " + type + "* data; int rows, cols; } " + field.member
                 : is_scalar(*field.slot)
                     ? type + " " + field.member
                     : type + " " + field.member + "[" + number(field.slot->size.count()) + "]") +
                "; /* " + note_on(field, is_dynamic()) + " */\n";
    }
    return text + "} " + file_ + "_" + name + ";\n\n";
}

std::string Generator::python_structure(const char* name, const char* doc,
                                        const std::vector<Field>& fields) const {
    std::string text = std::string("\n\nclass ") + name + "(ctypes.Structure):\n    \"\"\"" + doc +
                       "\"\"\"\n\n    __slots__ = ()  # a misspelled name is an AttributeError\n"
                       "    _fields_ = _fields(\n";
    for (const auto& field : fields) {
        const std::string type = std::string("ctypes.") + ctypes_name(type_of(*field.slot));
        text += "        (\"" + field.member + "\", " +
                (is_dynamic()             ? "_quantity(" + type + ")"
                 : is_scalar(*field.slot) ? type
                                          : type + " * " + number(field.slot->size.count())) +
                "),  # " + note_on(field, is_dynamic()) + "\n";
    }
    return text + "    )\n";
}

/// The model as a bf::LoadedRun takes it.
std::string Generator::run_library(const Files& files) const {
    const auto& d = diagram_;
    const auto truth = [](bool is) { return is ? "true" : "false"; };
    std::string text, hits, rates, plots;
    const auto array = [&](const std::string& type, const std::string& name, const std::string& rows) {
        if (rows.empty()) return std::string("nullptr");
        text += "constexpr " + type + " " + name + "[] = {" + rows.substr(0, rows.size() - 2) + "};\n";
        return name;
    };
    const auto channel = [&](const Node::End& end) {
        const auto named = std::find_if(d.enumerated.begin(), d.enumerated.end(), [&](const auto& e) {
            return e.end.node == end.node && e.end.slot == end.slot;
        });
        std::string names = "nullptr, 0";
        if (named != d.enumerated.end()) {
            std::string rows;
            for (const auto& [value, name] : named->names)
                rows += "{" + literal(value, Type::float64) + ", " + literal(name) + "}, ";
            const std::string its = "names_" + number(end.node) + "_" + number(end.slot);
            if (text.find(" " + its + "[]") == std::string::npos) array("bf_run_name", its, rows);
            names = its + ", " + number(static_cast<int>(named->names.size()));
        }
        return "{" + number(std::max(node(end.node).rate, constant_rate)) + ", " +
               truth(d.slot(end).size.is_matrix) + ", " + names + "}, ";
    };
    text = "// " + comment(d.name) + ": what recorders and viewers ask of the model.\n#include \"" + file_ +
           ".hpp\"\n\n#include \"bf/codegen/run_library.hpp\"\n\nnamespace " + file_ + "_run {\n\n";
    std::string recorded, inputs;
    for (const auto& signal : recorded_rows()) recorded += channel(signal.end);
    for (const auto& input : d.inputs)
        if (!place_of(input.end).member.empty()) inputs += channel(input.end);
    for (std::size_t r = 0; r < d.rates.size(); ++r) {
        const auto& rate = d.rates[r];
        rates += "{" + literal(d.period(static_cast<int>(r)), Type::float64) + ", " +
                 truth(rate.is_continuous) + ", " + truth(rate.trigger > 0) + "}, ";
        hits += "{" + std::to_string(rate.ticks) + ", " + std::to_string(rate.offset) + "}, ";
    }
    for (const auto& panel : d.plots) {
        std::string signals;
        for (const auto& signal : panel.signals) signals += (signals.empty() ? "" : "\n") + signal.path;
        plots += "{" + literal(panel.title) + ", " + literal(signals) + "}, ";
    }
    std::uint64_t fingerprint = fnv1a({});
    for (const auto& [name, content] : files)
        fingerprint = fnv1a(std::as_bytes(std::span(content)), fingerprint);
    const std::string its_rates = array("bf_run_rate", "rates", rates),
                      its_hits = array("bf::generated::Hits", "hits", hits),
                      its_plots = array("bf_run_panel", "plots", plots),
                      its_recorded = array("bf::generated::Channel", "recorded", recorded),
                      its_inputs = array("bf::generated::Channel", "inputs", inputs);
    return text +
           "static const bf::generated::RunTables& tables() {\n    static constexpr bf::generated::RunTables "
           "all{" +
           literal(d.name) + ", " + std::to_string(fingerprint) + "u,\n        " + its_rates + ", " +
           its_hits + ", " + number(static_cast<int>(d.rates.size())) + ", " + its_plots + ", " +
           number(static_cast<int>(d.plots.size())) + ", " + its_recorded + ", " + its_inputs +
           "};\n    return all;\n}\n\n} // namespace " + file_ + "_run\n\n" +
           (is_fmu_ ? "const bf_run_library* " + file_ + "_library()" // which others of the FMU stand beside
                    : "extern \"C\" const bf_run_library* bf_run_v1(void)") +
           " {\n    "
           "return &bf::generated::RunLibrary<" +
           class_ + ", " + file_ + "_run::tables>::get();\n}\n";
}

void Generator::add_interfaces(Files& files) const {
    constexpr const char* inputs_doc = "Written by the caller before each step; matrices column by column.";
    constexpr const char* outputs_doc = "Valid after each step; matrices column by column.";
    std::string header =
        "/* @title@: C interface of the generated model. */\n#pragma once\n\n#include <stdbool.h>\n#include "
        "<stdint.h>\n\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n"
        "typedef struct @prefix@_model @prefix@_model;\n\n@structures_of_c@";
    std::string source = std::string("// @title@: C interface.\n#include \"@prefix@_c.h\"\n\n#include "
                                     "\"@prefix@.hpp\"\n\n") +
                         (is_dynamic() ? "" : "#include \"bf/codegen/parameter_file.hpp\"\n\n") +
                         "#include <new>\n#include <string>\n" + std::string(c_source);
    // Names and docs stand in values of marks, which are not looked through for marks.
    std::string python =
        escape::python(diagram_.name + ", a model generated by BlockFactory: write inputs, call "
                                       "step(), read outputs.") +
        "\n";
    std::string accessors, structures, of_c, of_python;
    const auto add_structure = [&](const char* name, const char* type) {
        const std::string contents = std::string("_function(\"get_") + name + "\", ctypes.POINTER(" + type +
                                     "), _model)(self._model).contents";
        structures += std::string("        self.") + name + " = " +
                      (is_dynamic() ? "_Arrays(" + contents + ")" : contents) + "\n";
    };
    if (!inputs_.empty()) {
        of_c += c_structure("inputs", inputs_doc, inputs_);
        accessors += "/* Valid as long as the model. */\n@prefix@_inputs* "
                     "@prefix@_get_inputs(@prefix@_model* model);\n";
        source += "static_assert(sizeof(@prefix@_inputs) == sizeof(@Class@::Inputs), \"one layout\");\n"
                  "@prefix@_inputs* @prefix@_get_inputs(@prefix@_model* model) {\n    return "
                  "reinterpret_cast<@prefix@_inputs*>(&model->inputs);\n}\n";
        of_python += python_structure("Inputs", inputs_doc, inputs_);
        add_structure("inputs", "Inputs");
    }
    if (!outputs_.empty()) {
        of_c += c_structure("outputs", outputs_doc, outputs_);
        accessors += "const @prefix@_outputs* @prefix@_get_outputs(const @prefix@_model* model);\n";
        source += "static_assert(sizeof(@prefix@_outputs) == sizeof(@Class@::Outputs), \"one layout\");\n"
                  "const @prefix@_outputs* @prefix@_get_outputs(const @prefix@_model* model) {\n    return "
                  "reinterpret_cast<const @prefix@_outputs*>(&model->outputs);\n}\n";
        of_python += python_structure("Outputs", outputs_doc, outputs_);
        add_structure("outputs", "Outputs");
    }
    if (has_hosted()) {
        accessors += c_folder;
        source += c_folder_source;
    }
    accessors += is_dynamic() ? c_elaborate : c_load;
    source += is_dynamic() ? c_elaborate_source : c_load_source;
    header += accessors + "\n" + c_functions + "\n#ifdef __cplusplus\n}\n#endif\n";
    source += "\n} // extern \"C\"\n";
    std::string rates, rates_of_source;
    for (const auto& task : program_.tasks) {
        const std::string head =
            "bool " + file_ + "_step_" + rate_name(task.rate) + "(" + file_ + "_model* model)";
        rates += "/* " + rate_doc(task) + " The class has the rules of calling it. */\n" + head + ";\n";
        rates_of_source += head + " { return model->step_" + rate_name(task.rate) + "(); }\n";
    }
    const Marks marks{{"@rates@", rates},
                      {"@rates_of_source@", rates_of_source},
                      {"@folder_member@", has_hosted() ? ", own_folder" : ""},
                      {"@folder_argument@", has_hosted() ? ", folder=\"\"" : ""},
                      {"@folder_doc@", has_hosted() ? " Relative file names of\n        blocks are meant "
                                                      "from `folder` instead of the model's folder."
                                                    : ""},
                      {"@set_folder@", has_hosted() ? python_folder : ""},
                      {"@load@", is_dynamic() ? "elaborate" : "load_parameters"},
                      {"@structures@", structures},
                      {"@structures_of_c@", of_c},
                      {"@title@", comment(diagram_.name)},
                      {"@prefix@", file_},
                      {"@Class@", class_}};
    files[file_ + "_c.h"] = filled(header, marks);
    files[file_ + "_c.cpp"] = filled(source, marks);
    if (!is_dynamic()) files[file_ + "_run.cpp"] = run_library(files);
    files[file_ + ".py"] = python +
                           filled(std::string(python_head) + (is_dynamic() ? python_dynamic : ""), marks) +
                           of_python + filled(python_class, marks);
}

} // namespace bf::codegen
