#include "palette.hpp"

#include "bf/library/load.hpp"

namespace bf::service {

std::vector<LibraryBlock> palette() {
    std::vector<LibraryBlock> blocks;
    const auto registry = make_registry();
    for (const auto& plugin : registry->available_plugins()) try {
            registry->load_plugin(plugin);
        } catch (const PluginError&) { // it hides no other
        }
    for (const auto& type : registry->classes()) {
        LibraryBlock block{type->qualified_name(), type->group, type->doc};
        try {
            const auto instance = type->make({});
            for (const auto& slot : instance->declaration().slots) {
                if (slot.role == Role::input) block.inputs.push_back({slot.name, slot.doc});
                if (slot.role == Role::output) block.outputs.push_back({slot.name, slot.doc});
            }
        } catch (const std::exception&) { // it needs arguments
        }
        blocks.push_back(std::move(block));
    }
    return blocks;
}

} // namespace bf::service
