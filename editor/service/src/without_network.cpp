// Where there is no network, as in WebAssembly.
#include "live.hpp"

#include <stdexcept>

namespace bf::service {

struct Live::Connection {};

Live::Live(const std::string&, Listener) {
    throw std::runtime_error("a run of another program can be watched over a network alone");
}
Live::~Live() = default;
void Live::tune(const Tune&, const std::string&) {}
void Live::command(Action, const std::string&) {}
void Live::watch(std::vector<int>) {}
RunState Live::state() const { return {}; }
LiveReport Live::report() const { return {}; }
std::vector<SignalInfo> Live::signals() const { return {}; }

} // namespace bf::service
