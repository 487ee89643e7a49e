#include "code.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace bf::service {

GeneratedCode generated(const LoadedModel& model, Language language) {
    constexpr std::size_t most_blocks = 5000, most_bytes = std::size_t{4} << 20;
    const auto refuse = [](const std::string& what) {
        throw std::runtime_error(what +
                                 ", more than a page shows; bf generate writes the code into a folder");
    };
    if (model.diagram.nodes.size() > most_blocks)
        refuse("the model has " + std::to_string(model.diagram.nodes.size()) + " blocks");
    codegen::Options options = generation_options(model);
    if (language == Language::c) options.language = codegen::Language::c;
    std::vector<codegen::BlockPlace> places;
    GeneratedCode code;
    std::size_t bytes = 0;
    for (const auto& [name, text] : codegen::generate(model.diagram, options, &places)) {
        if (name.starts_with("include/")) continue;
        code.files.push_back({name, text});
        bytes += text.size();
    }
    if (bytes > most_bytes) refuse("the code has " + std::to_string(bytes >> 20) + " MiB");
    std::map<std::string, int> count;
    for (const auto& [node, file, first, last] : places) {
        code.places.push_back({model.diagram.nodes[node].path, file, first, last});
        ++count[file];
    }
    std::ranges::stable_sort(code.files, std::greater(),
                             [&](const TextFile& file) { return count[file.name]; });
    return code;
}

} // namespace bf::service
