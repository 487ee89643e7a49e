// Recordings: of files, and of runs while they run.
#include "simulation.hpp"

#include "bf/base/names.hpp"

#include <cmath>
#include <cstring>
#include <mutex>

namespace bf::python {

namespace fs = std::filesystem;

namespace {

/// A recording, to which a run may still add.
struct PythonRecording {
    recording::Recording content;
    std::vector<std::pair<std::string, std::size_t>> names = {}; ///< and the channels that they are of
    std::shared_ptr<std::mutex> growing = {}; ///< guards what a run adds; null: it is complete
};

/// Keeps what observers see in memory.
class MemoryRecorder final : public Run::Observer {
  public:
    MemoryRecorder(std::shared_ptr<PythonRecording> recording, const Run& run, std::vector<Quantity> signals)
        : recording_(std::move(recording)), signals_(std::move(signals)) {
        recording_->growing = std::make_shared<std::mutex>();
        recording_->content.complete = true;
        for (const auto& panel : run.plots()) {
            std::string paths;
            for (const auto& path : panel.signals) paths += (paths.empty() ? "" : "\n") + path;
            auto& plots = recording_->content.metadata["plots"];
            plots[std::to_string(100 + plots.size()) + " " + panel.title] = paths;
        }
        for (const auto& signal : signals_) {
            for (const auto& other : signal.info.other_names)
                recording_->names.emplace_back(other, recording_->content.channels.size());
            recording_->names.emplace_back(signal.path, recording_->content.channels.size());
            recording_->content.channels.push_back({signal.path, "/" + signal.path, signal.info, {}, {}});
        }
    }

    void observe(const Run& run) noexcept override {
        const std::int64_t time = std::llround(run.time() * 1e9);
        const std::lock_guard guard(*recording_->growing);
        for (std::size_t i = 0; i < signals_.size(); ++i) {
            const Quantity& signal = signals_[i];
            recording::Channel& channel = recording_->content.channels[i];
            if (signal.rate == 0 ? !channel.time_ns.empty() : !run.is_hit(signal.rate)) continue;
            channel.time_ns.push_back(time);
            channel.data.insert(channel.data.end(), signal.data, signal.data + signal.info.bytes());
        }
    }
    const PythonRecording* recording() const { return recording_.get(); }

  private:
    const std::shared_ptr<PythonRecording> recording_;
    const std::vector<Quantity> signals_;
};

struct PythonRecorder {
    nb::object simulation; ///< lives as long
    std::shared_ptr<Recorder> recorder;
    fs::path file;

    void close() {
        if (!recorder) return;
        PythonRun& run = nb::cast<PythonRun&>(simulation);
        const InUse use(run);
        run.run.remove_observer(*recorder);
        std::erase(run.recorders, recorder);
        const std::shared_ptr<Recorder> last = std::move(recorder);
        last->close();
    }
};

/// What the model asks for, or what these patterns of signals match.
std::vector<Quantity> chosen(PythonRun& self, const std::optional<std::vector<std::string>>& patterns) {
    if (!patterns) return self.run.recorded();
    std::vector<Quantity> all;
    for (const auto& pattern : *patterns) {
        const auto found = self.model->examined.diagram.match_signals(pattern);
        for (auto& quantity : self.run.quantities(found)) all.push_back(std::move(quantity));
        if (!found.empty()) continue;
        std::vector<std::string> names;
        for (const auto& signal : self.signals) names.push_back(signal.path);
        raise("UnknownName", "the run has no signal '" + pattern + "'" + did_you_mean(pattern, names));
    }
    return all;
}

std::size_t number_of(const PythonRecording& self, const std::string& name) {
    for (const auto& [known, number] : self.names)
        if (known == name) return number;
    try {
        return static_cast<std::size_t>(&self.content.channel(name) - self.content.channels.data());
    } catch (const std::runtime_error& error) {
        raise("UnknownName", error.what());
    }
}

/// Over complete recordings a view, of one that grows a copy of what is there.
template <class T>
nb::object array_of(nb::handle owner, const PythonRecording& recording, const std::vector<T>& data,
                    recording::ElementType type, std::vector<std::size_t> shape,
                    std::vector<std::int64_t> strides) {
    if (!recording.growing) return view(data.data(), type, shape, strides, owner);
    auto* copy = new std::vector<T>(data);
    const nb::capsule last(copy, [](void* at) noexcept { delete static_cast<std::vector<T>*>(at); });
    return view(copy->data(), type, shape, strides, last);
}

nb::object values(nb::handle owner, std::size_t number) {
    const auto& self = nb::cast<PythonRecording&>(owner);
    std::unique_lock<std::mutex> guard;
    if (self.growing) guard = std::unique_lock(*self.growing);
    const recording::Channel& channel = self.content.channels.at(number);
    const recording::ChannelInfo& info = channel.info;
    std::vector<std::size_t> shape{channel.samples()};
    std::vector<std::int64_t> strides{static_cast<std::int64_t>(info.elements())};
    if (info.is_matrix || info.rows != 1) shape.push_back(info.rows), strides.push_back(1);
    if (info.is_matrix) shape.push_back(info.cols), strides.push_back(info.rows);
    return array_of(owner, self, channel.data, info.type, shape, strides);
}

nb::object nanoseconds(nb::handle owner, std::size_t number) {
    const auto& self = nb::cast<PythonRecording&>(owner);
    std::unique_lock<std::mutex> guard;
    if (self.growing) guard = std::unique_lock(*self.growing);
    const auto& times = self.content.channels.at(number).time_ns;
    auto* copy = new std::vector<std::int64_t>(times);
    const nb::capsule last(copy,
                           [](void* at) noexcept { delete static_cast<std::vector<std::int64_t>*>(at); });
    const std::size_t count = copy->size();
    return nb::cast(nb::ndarray<nb::numpy, nb::ro, std::int64_t>(copy->data(), {count}, last));
}

} // namespace

void bind_recording(nb::module_& m) {
    nb::class_<PythonRecording>(m, "Recording")
        .def("__init__", [](PythonRecording* self) { new (self) PythonRecording(); })
        .def("_names",
             [](const PythonRecording& self) {
                 std::vector<std::string> names;
                 for (const auto& [name, number] : self.names) names.push_back(name);
                 return names;
             })
        .def("_number", number_of, nb::arg("name"))
        .def("_values", values, nb::arg("number"), nb::sig("def _values(self, number: int) -> NDArray[Any]"))
        .def("_nanoseconds", nanoseconds, nb::arg("number"),
             nb::sig("def _nanoseconds(self, number: int) -> NDArray[Any]"))
        .def(
            "_info",
            [](const PythonRecording& self, std::size_t number) {
                const recording::ChannelInfo& info = self.content.channels.at(number).info;
                nb::dict all;
                all["unit"] = info.unit;
                all["doc"] = info.doc;
                all["period"] = info.period;
                all["is_held"] = info.is_held;
                all["element_names"] = info.element_names;
                all["value_names"] = info.names;
                all["other_names"] = info.other_names;
                return all;
            },
            nb::arg("number"), nb::sig("def _info(self, number: int) -> dict[str, Any]"))
        .def_prop_ro(
            "complete", [](const PythonRecording& self) { return self.content.complete; },
            "False of a file that was cut or damaged: then the rest is what could be read.")
        .def_prop_ro(
            "defect", [](const PythonRecording& self) { return self.content.defect; },
            "What was found wrong.")
        .def_prop_ro(
            "metadata", [](const PythonRecording& self) { return self.content.metadata; },
            "Sets of texts by their names: model, overrides, plots.")
        .def_prop_ro(
            "attachments",
            [](const PythonRecording& self) {
                nb::dict all;
                for (const auto& one : self.content.attachments)
                    all[one.name.c_str()] = nb::bytes(one.data.data(), one.data.size());
                return all;
            },
            nb::sig("def attachments(self) -> dict[str, bytes]"),
            "Files in the recording by their names: the model's texts, snapshots.");

    nb::class_<PythonRecorder>(m, "Recorder", "Writes what a run does to an MCAP file, until it is closed.")
        .def_ro("file", &PythonRecorder::file)
        .def_prop_ro("_is_closed", [](const PythonRecorder& self) { return !self.recorder; })
        .def("close", &PythonRecorder::close,
             "Completes the file. Throws RunError when something could not be written.")
        .def(
            "checkpoint",
            [](PythonRecorder& self) {
                if (!self.recorder) raise("RunError", "the recording is closed");
                PythonRun& run = nb::cast<PythonRun&>(self.simulation);
                const InUse use(run);
                self.recorder->checkpoint(run.run);
            },
            "Adds a snapshot of the run, from which a replay can begin.")
        .def(
            "__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> Recorder"))
        .def(
            "__exit__", [](PythonRecorder& self, nb::handle, nb::handle, nb::handle) { self.close(); },
            nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none(),
            nb::sig("def __exit__(self, type: object, value: object, traceback: object, /) -> None"));

    m.def(
        "_record_file",
        [](nb::object simulation, const fs::path& file,
           const std::optional<std::vector<std::string>>& signals) {
            PythonRun& self = nb::cast<PythonRun&>(simulation);
            const InUse use(self);
            try {
                auto recorder = std::make_shared<Recorder>(self.run, chosen(self, signals), file,
                                                           self.model->examined.source);
                self.run.add_observer(*recorder);
                self.recorders.push_back(recorder);
                return PythonRecorder{simulation, recorder, file};
            } catch (const std::runtime_error& error) {
                raise("FileError", error.what());
            }
        },
        nb::arg("simulation"), nb::arg("file"), nb::arg("signals").none());
    m.def(
        "_record_memory",
        [](PythonRun& self, const std::optional<std::vector<std::string>>& signals, nb::object into) {
            const InUse use(self);
            auto recording = nb::cast<std::shared_ptr<PythonRecording>>(into);
            auto recorder = std::make_unique<MemoryRecorder>(recording, self.run,
                                                             to_record(self.run, chosen(self, signals)));
            self.run.add_observer(*recorder);
            self.observers.push_back(std::move(recorder));
        },
        nb::arg("simulation"), nb::arg("signals").none(), nb::arg("into"));
    m.def(
        "_end_record",
        [](PythonRun& self, const std::shared_ptr<PythonRecording>& recording) {
            const InUse use(self);
            for (auto at = self.observers.begin(); at != self.observers.end(); ++at)
                if (const auto* recorder = dynamic_cast<MemoryRecorder*>(at->get());
                    recorder && recorder->recording() == recording.get()) {
                    self.run.remove_observer(**at);
                    self.observers.erase(at);
                    break;
                }
        },
        nb::arg("simulation"), nb::arg("recording"));
    m.def(
        "_load_recording",
        [](const fs::path& file, const std::shared_ptr<PythonRecording>& into) {
            try {
                const WithoutGil parallel;
                into->content = recording::load(file);
                for (std::size_t i = 0; i < into->content.channels.size(); ++i)
                    into->names.emplace_back(into->content.channels[i].name, i);
            } catch (const std::runtime_error& error) {
                raise("FileError", error.what());
            }
        },
        nb::arg("file"), nb::arg("into"));
}

} // namespace bf::python
