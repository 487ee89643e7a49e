// Sweeps, in a process that has no other threads: see blockfactory/_worker.py.
#include "native.hpp"

#include "bf/library/sweep.hpp"

namespace bf::python {

void bind_sweep(nb::module_& m) {
    using Axes = std::vector<std::pair<std::string, std::vector<std::string>>>;
    m.def(
        "_sweep",
        [](const std::filesystem::path& file, const std::map<std::string, std::string>& texts,
           const Axes& axes, const std::vector<std::pair<std::string, std::string>>& changes,
           const std::vector<std::string>& finals, int jobs, nb::object progress) {
            Sweep asked{.file = file, .finals = finals, .jobs = jobs};
            for (const auto& [path, text] : texts) asked.texts.emplace(path, text);
            for (const auto& [name, values] : axes) asked.points.axes.push_back({name, values});
            for (const auto& [name, value] : changes) asked.overrides.push_back({name, value});
            nb::list rows;
            const auto done = sweep(asked, [&](std::size_t count) {
                return nb::cast<bool>(progress(count, asked.points.size()));
            });
            for (const auto& row : done) {
                if (!row) {
                    rows.append(nb::none());
                    continue;
                }
                nb::dict results;
                for (const auto& [name, value] : row->results) results[name.c_str()] = value;
                rows.append(nb::make_tuple(results, row->error, row->failed_at));
            }
            return rows;
        },
        nb::arg("file"), nb::arg("texts"), nb::arg("axes"), nb::arg("changes"), nb::arg("finals"),
        nb::arg("jobs"), nb::arg("progress"),
        nb::sig("def _sweep(file: str, texts: dict[str, str], axes: list[tuple[str, list[str]]], changes: "
                "list[tuple[str, str]], finals: list[str], jobs: int, progress: Callable[[int, int], bool]) "
                "-> list[Any]"));
}

} // namespace bf::python
