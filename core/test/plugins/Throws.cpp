// A plugin whose blocks cannot be made.
#include "bf/core/registry.hpp"

#include <stdexcept>

namespace {
class Thrower final : public bf::Block {
  public:
    explicit Thrower(const bf::Arguments& arguments) : Block(arguments) {
        throw std::runtime_error("no motor");
    }
};
class NumberThrower final : public bf::Block {
  public:
    explicit NumberThrower(const bf::Arguments& arguments) : Block(arguments) { throw 42; }
};
} // namespace

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.add<Thrower>("Thrower", "Throws.").add<NumberThrower>("NumberThrower", "Throws a number.");
}
