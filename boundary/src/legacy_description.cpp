#include "legacy_description.hpp"

#include <algorithm>

namespace bf::boundary {

namespace core = blockfactory::core;

namespace {

using Metadata = HostInformation::Metadata;

bool holds(const std::vector<Metadata>& list, const Metadata& metadata) {
    return std::any_of(list.begin(), list.end(), [&](const auto& m) { return m.name == metadata.name; });
}

/// Which parameters that the block counts are not in the list.
std::set<unsigned> unknown(const std::vector<Metadata>& list, unsigned count) {
    std::set<unsigned> indices;
    for (unsigned i = core::Block::NumberOfParameters; i < count; ++i) indices.insert(i);
    for (const auto& metadata : list) indices.erase(metadata.index);
    return indices;
}

} // namespace

LegacyDescription::LegacyDescription(const std::shared_ptr<const LegacyClass>& legacy,
                                     const Arguments& given) {
    const auto learn = [&](const LegacyObject& object) {
        for (const auto& metadata : object.information.declared())
            if (!holds(parameters, metadata)) parameters.push_back(metadata);
    };
    // The first object only says which parameters there are, as engines run it apart from the ports.
    LegacyObject parsed(legacy, given), sized(legacy, given);
    const bool is_parsed =
        parsed.call("parseParameters", [](core::Block& block, HostInformation& information) {
            return block.core::Block::parseParameters(&information) && block.parseParameters(&information);
        });
    const bool is_sized =
        sized.call("configureSizeAndPorts", [](core::Block& block, HostInformation& information) {
            return block.configureSizeAndPorts(&information);
        });
    learn(parsed);
    learn(sized);
    unsigned count = 0;
    parsed.call("numberOfParameters", [&](core::Block& block, HostInformation&) {
        count = block.numberOfParameters();
        return true;
    });
    if (const auto indices = unknown(parameters, count); !indices.empty()) {
        LegacyObject started(legacy, given);
        started.information.end_when_declared(indices);
        if (started.call("initialize", [](core::Block& block, HostInformation& information) {
                return block.initialize(&information);
            }))
            started.call("terminate", [](core::Block& block, HostInformation& information) {
                return block.terminate(&information);
            });
        learn(started);
    }
    const auto by_index = [](const Metadata& a, const Metadata& b) { return a.index < b.index; };
    std::stable_sort(parameters.begin(), parameters.end(), by_index);

    HostInformation all(legacy->library, legacy->name, given);
    for (const auto& metadata : parameters) all.addParameterMetadata(metadata);
    LogCapture log;
    const bool is_given = all.parseParameters(values);
    if (const auto& missing = all.missing(); !missing.empty()) {
        for (const auto& name : missing) problem += (problem.empty() ? "'" : ", '") + name + "'";
        problem = legacy->locate("parseParameters",
                                 (missing.size() == 1 ? "the argument " : "the arguments ") + problem +
                                     (missing.size() == 1 ? " is" : " are") + " missing; give a value");
    } else if (!is_given) {
        problem = legacy->locate("parseParameters", log.take());
    } else if (!is_sized) {
        // Alone, a block that reads its base's parameters where it parses its own fails, and is none the
        // worse.
        problem = is_parsed ? sized.message() : parsed.message();
    }
    if (is_sized) {
        inputs = sized.information.inputs();
        outputs = sized.information.outputs();
    }
    for (const unsigned index : unknown(parameters, count))
        parameters.emplace_back(core::ParameterType::DOUBLE, index, 1, 1);
    std::stable_sort(parameters.begin(), parameters.end(), by_index);
}

} // namespace bf::boundary
