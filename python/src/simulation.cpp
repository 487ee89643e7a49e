// Runs in Python.
#include "simulation.hpp"

#include "bf/analysis/gradient.hpp"
#include "bf/analysis/linearize.hpp"
#include "bf/analysis/trim.hpp"
#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/run/comparison.hpp"
#include "bf/run/snapshot.hpp"
#include "interruptible.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

namespace bf::python {

namespace {

thread_local Pending* stepping = nullptr; ///< of the run that this thread is in

[[noreturn]] void raise_failure(PythonRun& self) {
    const nb::object cause = self.pending.take();
    if (cause.is_valid() && PyObject_IsInstance(cause.ptr(), PyExc_Exception) == 0) { // as Ctrl-C
        PyErr_SetObject(cause.type().ptr(), cause.ptr());
        throw nb::python_error();
    }
    const nb::object type = nb::module_::import_("blockfactory.errors").attr("StepError");
    const nb::object error = type(self.run.failure(), self.run.time());
    if (cause.is_valid()) error.attr("__cause__") = cause;
    PyErr_SetObject(type.ptr(), error.ptr());
    throw nb::python_error();
}

/// When an analysis fails, what a block in Python raised goes with it: the run has not failed.
class Analysis {
  public:
    explicit Analysis(PythonRun& run) : run_(run) {}
    ~Analysis() {
        if (std::uncaught_exceptions() > before_) run_.pending.take();
    }
    Analysis(const Analysis&) = delete;
    Analysis& operator=(const Analysis&) = delete;

  private:
    PythonRun& run_;
    const int before_ = std::uncaught_exceptions();
};

/// Calls a function of Python when observers see a step.
class PythonObserver final : public Run::Observer {
  public:
    PythonObserver(nb::object function, PythonRun& run) : function_(std::move(function)), run_(run) {}
    ~PythonObserver() override {
        const nb::gil_scoped_acquire python;
        function_.reset();
    }
    void observe(const Run&) noexcept override {
        if (is_ending() || run_.pending.is_there()) return;
        const nb::gil_scoped_acquire python;
        try {
            function_(nb::find(run_));
        } catch (nb::python_error& error) {
            run_.pending.keep(error);
        } catch (...) {
        }
    }
    nb::handle function() const { return function_; }

  private:
    nb::object function_;
    PythonRun& run_;
};

/// That an observer calls; none of one that records.
nb::handle function_of(const Run::Observer& observer) {
    const auto* const python = dynamic_cast<const PythonObserver*>(&observer);
    return python ? python->function() : nb::handle();
}

/// Functions that observe a run often hold it, as methods do: Python finds such cycles.
int traverse(PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    if (nb::inst_ready(self))
        for (const auto& observer : nb::inst_ptr<PythonRun>(self)->observers)
            Py_VISIT(function_of(*observer).ptr());
    return 0;
}
int clear(PyObject* self) {
    if (!nb::inst_ready(self)) return 0;
    PythonRun& run = *nb::inst_ptr<PythonRun>(self);
    const auto functions = std::stable_partition(run.observers.begin(), run.observers.end(),
                                                 [](const auto& o) { return !function_of(*o).is_valid(); });
    for (auto observer = functions; observer != run.observers.end(); ++observer)
        run.run.remove_observer(**observer);
    run.observers.erase(functions, run.observers.end());
    return 0;
}
PyType_Slot cycles[] = {
    {Py_tp_traverse, reinterpret_cast<void*>(traverse)},
    {Py_tp_clear, reinterpret_cast<void*>(clear)},
    {0, nullptr},
};

/// Looks at Ctrl-C about twenty times a second, however long a step takes.
class Pauses {
  public:
    /// How many steps until the next look.
    std::int64_t steps() const { return steps_; }
    void look() {
        using namespace std::chrono;
        const auto now = steady_clock::now();
        const auto spent = now - last_;
        if (spent < 20ms && steps_ < (std::int64_t{1} << 40)) steps_ *= 2;
        if (spent > 80ms) steps_ = std::max<std::int64_t>(1, steps_ / 2);
        last_ = now;
    }

  private:
    std::int64_t steps_ = 1;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Steps until so many were done in all, or until the event. True: it happened.
bool advance(PythonRun& self, std::int64_t last, const std::string& until) {
    const InUse use(self);
    self.require_started();
    std::optional<Comparison> event;
    if (!until.empty()) event.emplace(self.run, until);
    Pauses pauses;
    while (self.run.steps() < last) {
        const std::int64_t next =
            std::min(last, self.run.steps() + std::min(pauses.steps(), last - self.run.steps()));
        bool happened = false, failed = false;
        {
            const WithoutGil parallel;
            if (event) {
                const double limit = static_cast<double>(next) * self.run.period();
                happened = self.run.run_until([&](const Simulation&) { return (*event)(); }, limit);
                failed = !self.run.failure().empty();
            } else {
                while (!failed && self.run.steps() < next && !self.pending.is_there() && !is_ending())
                    failed = !self.run.step();
            }
            pauses.look();
        }
        if (failed) raise_failure(self);
        self.pending.raise();
        if (happened) return true;
        if (is_ending()) raise("RunError", "the interpreter ends");
        if (PyErr_CheckSignals() != 0) throw nb::python_error();
    }
    return false;
}

void step(PythonRun& self, std::int64_t count) {
    if (count != 1) {
        if (count < 0)
            raise("RunError", "a run makes no " + std::to_string(count) + " steps; give a number from 0");
        advance(self, self.run.steps() + count, "");
        return;
    }
    const InUse use(self);
    self.require_started();
    bool failed = false;
    {
        const WithoutGil parallel;
        failed = !self.run.step();
    }
    if (failed) raise_failure(self);
    self.pending.raise();
}

/// Until which step a run goes; `has_event`: it may have no other end.
std::int64_t last_step(const PythonRun& self, std::optional<double> duration, std::optional<double> time,
                       bool has_event) {
    double end = std::numeric_limits<double>::infinity();
    if (duration && time) raise("RunError", "both a duration and a time were given; give one");
    if (duration)
        end = self.run.time() + *duration;
    else if (time)
        end = *time;
    else
        end = self.run.stop_time();
    if (std::isnan(end) || end < 0) raise("RunError", "a run does not end at " + std::to_string(end) + " s");
    if (std::isinf(end) && !has_event)
        raise("RunError", self.run.name() + " does not say when it ends: give a duration, run(10), or write "
                                            "'stop: SECONDS' in the model");
    if (std::isinf(end)) return std::numeric_limits<std::int64_t>::max();
    const std::int64_t last = self.run.steps_before(end);
    if (time && last < self.run.steps())
        raise("RunError", "a run does not go back: it is at " + number_text(self.run.time()) +
                              " s, after the " + number_text(end) +
                              " s to which it should go; restore a snapshot from before, or start it anew");
    return last;
}

bool run(PythonRun& self, std::optional<double> duration, std::optional<double> time,
         const std::string& until) {
    return advance(self, last_step(self, duration, time, !until.empty()), until);
}

const Quantity& signal(PythonRun& self, const std::string& path) {
    const auto found = self.signal_numbers.find(path);
    if (found != self.signal_numbers.end()) return self.signals[found->second];
    try {
        return find(self.signals, path);
    } catch (const RunError& error) {
        raise("UnknownName", error.what());
    }
}

const Quantity& named(const std::vector<Quantity>& all, const std::string& path, const char* kind) {
    std::vector<std::string> names;
    for (const auto& quantity : all) {
        if (quantity.path == path) return quantity;
        names.push_back(quantity.path);
    }
    raise("UnknownName",
          std::string("the run has no ") + kind + " '" + path + "'" + did_you_mean(path, names));
}

/// Numbers of Python for a quantity; one expands.
std::vector<double> values_for(const std::string& path, const nb::object& shape, nb::handle value) {
    const nb::object numpy = nb::module_::import_("numpy");
    nb::object array;
    try {
        array = numpy.attr("asarray")(value, numpy.attr("float64"));
    } catch (nb::python_error& error) {
        raise("WrongValue", path + ": " + nb::cast<std::string>(nb::str(error.value())));
    }
    const nb::object given = array.attr("shape");
    if (nb::len(given) > 0 && !given.equal(shape))
        raise("WrongValue", path + " has shape " + nb::cast<std::string>(nb::str(shape)) +
                                ", but the value has shape " + nb::cast<std::string>(nb::str(given)) +
                                "; give one of that shape, or one number for all elements");
    return numbers_of(array);
}

using Asked = std::vector<std::pair<std::string, nb::object>>;

void set_parameters(PythonRun& self, const Asked& asked, bool are_variables) {
    const InUse use(self);
    std::vector<ParameterValue> values;
    for (const auto& [path, value] : asked) {
        if (are_variables) {
            values.push_back({path, numbers_of(value)});
        } else {
            const Quantity& parameter = named(self.parameters, path, "parameter");
            values.push_back({path, values_for(path, shape_of(parameter.info), value)});
        }
    }
    try {
        ParameterChange change = self.run.prepare(self.run.follow(values));
        if (const Status status = self.run.apply(change); !status) throw RunError(change.why_refused(status));
        self.run.accept(values);
    } catch (const std::runtime_error& error) {
        raise("WrongValue", error.what());
    }
    for (const auto& recorder : self.recorders)
        for (const auto& [path, all] : values)
            if (!are_variables) recorder->parameter_changed(self.run.steps(), path, all);
}

void set_input(PythonRun& self, const std::string& path, const nb::object& value) {
    const InUse use(self);
    const Quantity& input = named(self.inputs, path, "input");
    write_values(input.data, input.type, static_cast<int>(input.info.elements()),
                 values_for(path, shape_of(input.info), value));
}

std::vector<std::string> paths(const std::vector<Quantity>& quantities) {
    std::vector<std::string> all;
    for (const auto& quantity : quantities) all.push_back(quantity.path);
    return all;
}

nb::dict checks(const PythonRun& self) {
    nb::dict all;
    for (const auto& check : self.run.checks())
        all[check.name.c_str()] = check.is_boolean ? nb::cast(check.value != 0) : nb::cast(check.value);
    return all;
}

} // namespace

void Pending::keep(nb::python_error& error, bool is_of_block) noexcept {
    if (!error_.is_valid()) {
        error_ = nb::borrow(error.value());
        is_of_block_ = is_of_block;
    }
    is_there_ = true;
}
nb::object Pending::take() noexcept {
    is_there_ = false;
    return std::move(error_);
}
void Pending::raise() {
    if (!is_there_) return;
    const nb::object error = take();
    PyErr_SetObject(error.type().ptr(), error.ptr());
    throw nb::python_error();
}
void Pending::raise_unless_of_block() {
    if (is_there_ && is_of_block_ && PyObject_IsInstance(error_.ptr(), PyExc_Exception) == 1)
        take();
    else // as Ctrl-C in a block
        raise();
}

InUse::InUse(PythonRun& run) : run_(run), around_(stepping) {
    if (run_.is_in_use.exchange(true))
        raise("RunError", "the simulation is being stepped by another thread, or by its own observer; give "
                          "each thread a simulation of its own, or wait");
    stepping = &run_.pending;
}
InUse::~InUse() {
    stepping = around_;
    run_.is_in_use = false;
}

void keep_cause(nb::python_error& error) noexcept {
    if (stepping) stepping->keep(error, true);
}

PythonRun::PythonRun(std::shared_ptr<PythonModel> of)
    : model(std::move(of)), run(model->examined.diagram), signals(run.signals()), inputs(run.inputs()),
      parameters(run.parameters()) {
    for (auto& input : inputs) signals.push_back(input);
    for (std::size_t i = 0; i < signals.size(); ++i) signal_numbers.try_emplace(signals[i].path, i);
}

PythonRun::~PythonRun() {
    const nb::error_scope around; // of an exception on whose way the run is let go
    const WithoutGil parallel;
    run.stop();
}

void PythonRun::require_started() const {
    if (!is_started) raise("RunError", "the simulation was stopped; start() begins anew");
}

void bind_simulation(nb::module_& m) {
    nb::class_<PythonRun>(m, "Simulation", nb::type_slots(cycles))
        .def(
            "__init__",
            [](PythonRun* self, std::shared_ptr<PythonModel> model) {
                if (!model->examined.diagnostics.empty()) throw model::Errors(model->examined.diagnostics);
                new (self) PythonRun(std::move(model));
            },
            nb::arg("model"))
        .def(
            "start",
            [](PythonRun& self) {
                const InUse use(self);
                const WithoutGil parallel;
                self.linearizer.reset();
                self.run.start();
                self.is_started = true;
            },
            "Begins anew, at 0 s. Throws RunError where a device cannot be opened.")
        .def(
            "stop",
            [](PythonRun& self) {
                const InUse use(self);
                self.is_started = false;
                const WithoutGil parallel;
                self.run.stop();
            },
            "Closes devices and puts actuators back; signals keep their values.")
        .def(
            "step", [](PythonRun& self) { step(self, 1); }, "One base step. Throws StepError.")
        .def("step", step, nb::arg("count"), "So many base steps.")
        .def(
            "_last_step",
            [](const PythonRun& self, std::optional<double> duration, std::optional<double> time) {
                return last_step(self, duration, time, true);
            },
            nb::arg("duration").none(), nb::arg("time").none())
        .def("_run", run, nb::arg("duration") = nb::none(), nb::arg("time") = nb::none(),
             nb::arg("until") = "")
        .def_prop_ro(
            "time", [](const PythonRun& self) { return self.run.time(); }, "Of the next step [s].")
        .def_prop_ro(
            "steps", [](const PythonRun& self) { return self.run.steps(); }, "That were done.")
        .def_prop_ro(
            "period", [](const PythonRun& self) { return self.run.period(); }, "Of a base step [s].")
        .def_prop_ro(
            "failure", [](const PythonRun& self) { return self.run.failure(); },
            "'block: message' of a step that failed, else empty.")
        .def_prop_ro("checks", checks, nb::sig("def checks(self) -> dict[str, bool | float]"),
                     "What the model's check blocks say now.")
        .def(
            "__getitem__",
            [](nb::handle self, const std::string& path) {
                const Quantity& found = signal(nb::cast<PythonRun&>(self), path);
                return view(found.data, found.info, self);
            },
            nb::arg("path"), nb::sig("def __getitem__(self, path: str, /) -> NDArray[Any]"),
            "What the signal is now: a view that follows the run, keeps it alive, and cannot be written. () "
            "of a scalar, (n,), or (rows, columns).")
        .def(
            "__contains__",
            [](PythonRun& self, nb::handle path) {
                std::string name;
                return nb::try_cast(path, name) && self.signal_numbers.contains(name);
            },
            nb::arg("path"), nb::sig("def __contains__(self, path: object, /) -> bool"))
        .def(
            "_linearize",
            [](PythonRun& self, const analysis::LinearizeOptions& options) {
                const InUse use(self);
                self.require_started();
                const Analysis analysed(self);
                const auto here = self.run.snapshot();
                analysis::LinearSystem found;
                {
                    const WithoutGil parallel;
                    try {
                        if (!self.linearizer || self.linearizer->options() != options)
                            self.linearizer.emplace(self.run, options);
                        found = (*self.linearizer)();
                    } catch (...) {
                        self.run.restore(here);
                        throw;
                    }
                    self.run.restore(here);
                }
                self.pending.raise_unless_of_block();
                return found;
            },
            nb::arg("options"))
        .def(
            "_gradient",
            [](PythonRun& self, std::vector<std::string> by, std::string cost, double duration, bool at_end,
               const std::string& way) {
                const InUse use(self);
                using Over = analysis::GradientOptions::Over;
                const auto its = analysis::way_named(way);
                if (!its) raise("RunError", "way is 'cheaper', 'forward' or 'adjoint', not '" + way + "'");
                analysis::GradientOptions options{.by = std::move(by),
                                                  .cost = std::move(cost),
                                                  .over = at_end ? Over::end : Over::all,
                                                  .duration = duration,
                                                  .way = *its};
                const Analysis analysed(self);
                auto found = interruptible(
                    [&](std::function<bool()> go_on) {
                        options.go_on = std::move(go_on);
                        return analysis::gradient(self.run, options);
                    },
                    [] { return false; });
                return std::move(*found);
            },
            nb::arg("by"), nb::arg("cost"), nb::arg("duration"), nb::arg("at_end"), nb::arg("way"))
        .def(
            "_trim",
            [](PythonRun& self, const std::vector<std::string>& free,
               const std::vector<std::pair<std::string, double>>& hold,
               const std::vector<std::pair<std::string, double>>& target,
               const std::vector<std::pair<std::string, std::pair<double, double>>>& bounds) {
                const InUse use(self);
                self.require_started();
                analysis::TrimOptions options{free, hold, target, {}};
                for (const auto& [name, range] : bounds)
                    options.bounds.push_back({name, range.first, range.second});
                analysis::TrimResult found;
                const Analysis analysed(self);
                {
                    const WithoutGil parallel;
                    found = analysis::trim(self.run, options);
                }
                self.pending.raise_unless_of_block();
                return std::pair(found.free, found.residuals);
            },
            nb::arg("free"), nb::arg("hold"), nb::arg("target"), nb::arg("bounds"))
        .def("_signals", [](const PythonRun& self) { return paths(self.signals); })
        .def("_inputs", [](const PythonRun& self) { return paths(self.inputs); })
        .def("_parameters", [](const PythonRun& self) { return paths(self.parameters); })
        .def(
            "_parameter",
            [](nb::handle self, const std::string& path) {
                const Quantity& found = named(nb::cast<PythonRun&>(self).parameters, path, "parameter");
                return view(found.data, found.info, self);
            },
            nb::arg("path"), nb::sig("def _parameter(self, path: str) -> NDArray[Any]"))
        .def(
            "_input",
            [](nb::handle self, const std::string& path) {
                const Quantity& found = named(nb::cast<PythonRun&>(self).inputs, path, "input");
                return view(found.data, found.info, self);
            },
            nb::arg("path"), nb::sig("def _input(self, path: str) -> NDArray[Any]"))
        .def("_set_parameters", set_parameters, nb::arg("values"), nb::arg("are_variables"))
        .def("_set_input", set_input, nb::arg("path"), nb::arg("value"))
        .def("_variables",
             [](const PythonRun& self) {
                 std::vector<std::pair<std::string, std::vector<double>>> all;
                 for (auto& [path, values] : self.run.variables()) all.emplace_back(path, values);
                 return all;
             })
        .def(
            "snapshot",
            [](PythonRun& self) {
                const InUse use(self);
                const auto bytes = make_snapshot(self.run);
                return nb::bytes(bytes.data(), bytes.size());
            },
            "All that the run needs to go on bit for bit, as the content of a snapshot file. Throws RunError "
            "where a block cannot be saved.")
        .def(
            "restore",
            [](PythonRun& self, nb::bytes snapshot) {
                const InUse use(self);
                self.require_started();
                const auto* data = static_cast<const std::byte*>(snapshot.data());
                restore_snapshot(self.run, {data, snapshot.size()}, "given");
                self.pending.take();
            },
            nb::arg("snapshot"),
            "Goes on from there, also after a failure. Throws RunError for a snapshot of another model.")
        .def(
            "_observe",
            [](PythonRun& self, nb::object function) {
                const InUse use(self);
                auto observer = std::make_unique<PythonObserver>(std::move(function), self);
                self.run.add_observer(*observer);
                self.observers.push_back(std::move(observer));
            },
            nb::arg("function"))
        .def(
            "_forget",
            [](PythonRun& self, nb::handle function) {
                const InUse use(self);
                const auto found =
                    std::find_if(self.observers.begin(), self.observers.end(), [&](const auto& o) {
                        const nb::handle its = function_of(*o);
                        return its.is_valid() && its.equal(function);
                    });
                if (found == self.observers.end())
                    raise("UnknownName", "the simulation does not call this function");
                self.run.remove_observer(**found);
                self.observers.erase(found);
            },
            nb::arg("function"));
}

} // namespace bf::python
