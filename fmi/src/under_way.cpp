#include "bf/fmi/under_way.hpp"

#include "bf/fmi/archive.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <unistd.h>
#include <vector>

namespace bf::fmi {

namespace {

struct AllUnderWay {
    std::mutex mutex;
    std::vector<const UnderWay*> items;
    bool is_left_to_others = false;
};
/// Looked at while static objects are destroyed, so it never is.
AllUnderWay& all_under_way() {
    static auto* const all = new AllUnderWay;
    return *all;
}

} // namespace

UnderWay::UnderWay(std::string fmu) : fmu_(std::move(fmu)), process_(::getpid()) {
    // The other handlers still run: in glibc an exit() in one of them goes on with the rest.
    [[maybe_unused]] static const bool is_asked = std::atexit([] {
                                                      if (say_all()) ::exit(1);
                                                  }) == 0 &&
                                                  std::at_quick_exit([] {
                                                      if (say_all()) std::_Exit(1);
                                                  }) == 0;
    const std::lock_guard lock(all_under_way().mutex);
    all_under_way().items.push_back(this);
}

UnderWay::~UnderWay() {
    const std::lock_guard lock(all_under_way().mutex);
    std::erase(all_under_way().items, this);
}

void UnderWay::leave_to_others() noexcept { all_under_way().is_left_to_others = true; }

bool UnderWay::say_all() noexcept {
    auto& all = all_under_way();
    bool is_said = false;
    const std::lock_guard lock(all.mutex);
    for (const auto* its : all.items) {
        const char* const function = its->function_.load(std::memory_order_relaxed);
        if (!function || its->process_ != ::getpid() || all.is_left_to_others) continue;
        std::fprintf(stderr, "bf: %s: %s ended the process\n", its->fmu_.c_str(), function);
        is_said = true;
    }
    all.items.clear();
    if (is_said) TemporaryFolder::remove_all();
    return is_said;
}

} // namespace bf::fmi
