// The module blockfactory._native, errors, arrays, and the end of the interpreter.
#include "native.hpp"

#include "bf/base/files.hpp"
#include "bf/base/names.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/core/registry.hpp"
#include "bf/model/location.hpp"

#include <chrono>
#include <thread>
#include <unistd.h>

namespace bf::python {

namespace {

std::atomic<bool> ends = false;
std::atomic<int> computing = 0; ///< threads of Python in which C++ computes without the GIL

/// Called by atexit, when Python still works: afterwards no thread computes.
void end() {
    ends = true;
    Py_BEGIN_ALLOW_THREADS;
    using namespace std::chrono_literals;
    for (int i = 0; i < 5000 && computing > 0; ++i) std::this_thread::sleep_for(1ms);
    Py_END_ALLOW_THREADS;
}

nb::object error_class(const char* name) { return nb::module_::import_("blockfactory.errors").attr(name); }

void translate(const std::exception_ptr& thrown, void*) {
    try {
        std::rethrow_exception(thrown);
    } catch (const model::Errors& error) {
        const nb::object type = error_class("ModelError");
        nb::list diagnostics;
        for (const auto& diagnostic : error.diagnostics()) diagnostics.append(nb::cast(diagnostic));
        PyErr_SetObject(type.ptr(), type(error.what(), diagnostics).ptr());
    } catch (const RunError& error) {
        PyErr_SetString(error_class("RunError").ptr(), error.what());
    } catch (const PluginError& error) {
        PyErr_SetString(error_class("PluginError").ptr(), error.what());
    } catch (const FileError& error) {
        PyErr_SetString(error_class("FileError").ptr(), error.what());
    } catch (const codegen::GenerationError& error) {
        PyErr_SetString(error_class("GenerationError").ptr(), error.what());
    }
}

} // namespace

bool is_ending() noexcept { return ends; }

WithoutGil::WithoutGil() noexcept {
    if (ends) return; // what is destroyed then is destroyed by the thread that ends
    ++computing;
    state_ = PyEval_SaveThread();
}
WithoutGil::~WithoutGil() {
    if (!state_) return;
    --computing;
    if (ends)
        for (;;) ::pause();
    PyEval_RestoreThread(state_);
}

void raise(const char* name, const std::string& text) {
    PyErr_SetString(error_class(name).ptr(), text.c_str());
    throw nb::python_error();
}

const char* dtype_of(recording::ElementType type) {
    using recording::ElementType;
    switch (type) {
    case ElementType::Double: return "float64";
    case ElementType::Single: return "float32";
    case ElementType::Int8: return "int8";
    case ElementType::Uint8: return "uint8";
    case ElementType::Int16: return "int16";
    case ElementType::Uint16: return "uint16";
    case ElementType::Int32: return "int32";
    case ElementType::Uint32: return "uint32";
    case ElementType::Boolean: return "bool";
    }
    return "float64";
}

nb::object view(const void* data, recording::ElementType type, const std::vector<std::size_t>& shape,
                const std::vector<std::int64_t>& strides, nb::handle owner) {
    using recording::ElementType;
    const auto array = [&]<class T>(std::type_identity<T>) {
        return nb::cast(nb::ndarray<nb::numpy, nb::ro>(data, shape.size(), shape.data(), owner,
                                                       strides.data(), nb::dtype<T>()));
    };
    switch (type) {
    case ElementType::Single: return array(std::type_identity<float>{});
    case ElementType::Int8: return array(std::type_identity<std::int8_t>{});
    case ElementType::Uint8: return array(std::type_identity<std::uint8_t>{});
    case ElementType::Int16: return array(std::type_identity<std::int16_t>{});
    case ElementType::Uint16: return array(std::type_identity<std::uint16_t>{});
    case ElementType::Int32: return array(std::type_identity<std::int32_t>{});
    case ElementType::Uint32: return array(std::type_identity<std::uint32_t>{});
    case ElementType::Boolean: return array(std::type_identity<bool>{});
    case ElementType::Double: break;
    }
    return array(std::type_identity<double>{});
}

nb::object view(const void* data, const recording::ChannelInfo& info, nb::handle owner) {
    if (info.is_matrix) return view(data, info.type, {info.rows, info.cols}, {1, info.rows}, owner);
    if (info.rows != 1) return view(data, info.type, {info.rows}, {1}, owner);
    return view(data, info.type, {}, {}, owner);
}

nb::tuple shape_of(const recording::ChannelInfo& info) {
    if (info.is_matrix) return nb::make_tuple(info.rows, info.cols);
    if (info.rows != 1) return nb::make_tuple(info.rows);
    return nb::make_tuple();
}

std::vector<double> numbers_of(nb::handle value) {
    const nb::object numpy = nb::module_::import_("numpy");
    const nb::object array = numpy.attr("asarray")(value, numpy.attr("float64"));
    const auto flat =
        nb::cast<nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>>(
            numpy.attr("ravel")(array, "F"));
    return {flat.data(), flat.data() + flat.size()};
}

void bind_errors(nb::module_& m) {
    nb::class_<model::Diagnostic>(m, "Diagnostic",
                                  "One thing that is wrong with a model: where, what, and what to do.")
        .def_prop_ro(
            "file",
            [](const model::Diagnostic& d) {
                return d.where.file ? std::optional(*d.where.file) : std::nullopt;
            },
            "The file; None for what a program made.")
        .def_prop_ro(
            "line", [](const model::Diagnostic& d) { return d.where.line; },
            "From 1; 0: it stands in no file.")
        .def_prop_ro(
            "column", [](const model::Diagnostic& d) { return d.where.column; }, "From 1.")
        .def_ro("path", &model::Diagnostic::path, "Dotted path of the block; empty for the model itself.")
        .def_ro("message", &model::Diagnostic::message,
                "What is wrong, with the value and the violated rule.")
        .def_ro("remedy", &model::Diagnostic::remedy, "What to do; may be empty.")
        .def_prop_ro(
            "fixes",
            [](const model::Diagnostic& d) {
                std::vector<std::pair<std::string, std::string>> fixes;
                for (const auto& fix : d.fixes) fixes.emplace_back(fix.title, fix.operation);
                return fixes;
            },
            "What would mend it: titles, and operations for Model.edit in their text form.")
        .def_ro("is_open", &model::Diagnostic::is_open, "Is it a port that has no wire yet?")
        .def("__str__", &model::Diagnostic::text)
        .def("__repr__", [](const model::Diagnostic& d) { return "<Diagnostic " + d.text() + ">"; });
    nb::register_exception_translator(translate);
}

} // namespace bf::python

NB_MODULE(_native, m) {
    using namespace bf::python;
    // Models in modules and notebooks live until the interpreter ends, and its end frees nothing of them.
    nb::set_leak_warnings(false);
    nb::module_::import_("atexit").attr("register")(nb::cpp_function(end));
    m.def(
        "_version", [] { return BF_VERSION; }, "That of the library.");
    m.def(
        "_did_you_mean",
        [](const std::string& name, const std::vector<std::string>& known) {
            return bf::did_you_mean(name, known);
        },
        nb::arg("name"), nb::arg("known"), "What follows a message about an unknown name.");
    bind_errors(m);
    bind_model(m);
    bind_recording(m);
    bind_analysis(m);
    bind_measure(m);
    bind_simulation(m);
    bind_sweep(m);
}
