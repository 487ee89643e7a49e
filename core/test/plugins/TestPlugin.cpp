// A plugin with one block.
#include "bf/core/registry.hpp"

namespace {

class Double final : public bf::Block {
  public:
    using Block::Block;
    bf::Input<double> u{this, "u"};
    bf::Output<double> y{this, "y"};
    bf::Status output(bf::Now at, bf::Out out) const noexcept override {
        out[y] = 2 * at[u];
        return bf::ok;
    }
};

} // namespace

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("test").add<Double>("Double", "y = 2 u.");
}
