// Where there is no network, no other program and no folder for code, as in WebAssembly.
#include "code.hpp"
#include "committed.hpp"
#include "live.hpp"

#include <stdexcept>

namespace bf::service {

struct Live::Connection {};

Live::Live(const std::string&, Listener) {
    throw std::runtime_error("a run of another program can be watched over a network alone");
}
Live::~Live() = default;
void Live::tune(const Tune&, int) {}
void Live::command(Action, int) {}
void Live::watch(std::vector<int>) {}
void Live::edit(const realtime::Edit&, const std::string&, int, std::function<void(std::optional<RunEdit>)>) {
}
int Live::advertised() const { return 0; }
RunState Live::state() const { return {}; }
LiveReport Live::report() const { return {}; }
std::vector<SignalInfo> Live::signals() const { return {}; }

model::Model committed(const std::filesystem::path&) {
    throw std::runtime_error("there is no git here; compare with another file");
}

GeneratedCode generated(const LoadedModel&, Language) {
    throw std::runtime_error("a published page generates no code; bf generate does");
}

} // namespace bf::service
