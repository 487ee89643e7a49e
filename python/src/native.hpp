// What the files of the Python module share.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"
#include "bf/recording/reader.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::python {

namespace nb = nanobind;

/// A model in Python: elaborated, with what its recordings and drawings need.
struct PythonModel {
    ExaminedModel examined;
    model::Model document;
};

/// An array of numpy over elements that lie column by column, which lives as long as `owner`, and which
/// nobody writes.
nb::object view(const void* data, recording::ElementType type, const std::vector<std::size_t>& shape,
                const std::vector<std::int64_t>& strides, nb::handle owner);
/// The same of one value.
nb::object view(const void* data, const recording::ChannelInfo& info, nb::handle owner);

/// () of a scalar, (n,) of a 1-D signal, (n, m) of a matrix.
nb::tuple shape_of(const recording::ChannelInfo& info);
/// As numpy calls it: "float64".
const char* dtype_of(recording::ElementType type);

/// Throws the exception `name` of blockfactory.errors with these arguments.
[[noreturn]] void raise(const char* name, const std::string& text);

/// Numbers of any array-like, column by column. Throws TypeError, ValueError.
std::vector<double> numbers_of(nb::handle value);

/// Is the interpreter about to end? From then on nothing that Python keeps may be waited for.
bool is_ending() noexcept;

/// Lets other threads of Python run while C++ computes. A thread that comes back while the interpreter ends
/// stops for good, as threads do in Python 3.14: older ones would unwind through C++ and end the process.
class WithoutGil {
  public:
    WithoutGil() noexcept;
    ~WithoutGil();
    WithoutGil(const WithoutGil&) = delete;
    WithoutGil& operator=(const WithoutGil&) = delete;

  private:
    PyThreadState* state_ = nullptr; ///< null: the GIL was not let go
};

void bind_errors(nb::module_& m);
void bind_model(nb::module_& m);
void bind_simulation(nb::module_& m);
void bind_recording(nb::module_& m);
void bind_sweep(nb::module_& m);
void bind_analysis(nb::module_& m);
void bind_measure(nb::module_& m);

} // namespace bf::python
