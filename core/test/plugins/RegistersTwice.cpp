// A plugin that gives two blocks one name.
#include "bf/core/registry.hpp"

namespace {
class Nothing final : public bf::Block {
  public:
    using Block::Block;
};
} // namespace

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.add<Nothing>("Same", "Does nothing.").add<Nothing>("Same", "Does nothing.");
}
