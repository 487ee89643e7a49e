#include "bf/middleware/driver_news.hpp"

#include "bf/middleware/clock.hpp"

#include <utility>

namespace bf::middleware {

void DriverNews::came(std::uint64_t from) {
    turns_.sent(from);
    if (!turns_.are_two() || std::exchange(are_two_told_, true)) return;
    const auto [one, other] = turns_.newest();
    tell({"", " send commands to it by turns; end one of them", {one, other}, now()});
}

void DriverNews::left_out(const std::string& topic, std::uint64_t from, const std::string& what) {
    ++rejected_;
    constexpr std::size_t most = 10;
    if (known_.size() == most || !known_.insert(std::to_string(from) + topic + what).second) return;
    tell({"left out what came to the topic '" + topic + "': ",
          " sends " + what + "; so are those that follow",
          {from},
          now()});
}

void DriverNews::tell(Nameless what) {
    const std::lock_guard lock(mutex_);
    nameless_.push_back(std::move(what));
}

void DriverNews::find_names(const std::function<std::string(std::uint64_t)>& node_of) {
    constexpr double patience = 1; // s
    const std::lock_guard lock(mutex_);
    std::erase_if(nameless_, [&](const Nameless& its) {
        std::string names;
        for (const auto program : its.who) {
            const std::string node = node_of(program);
            if (node.empty() && now() - its.time < patience) return false;
            names +=
                (names.empty() ? "" : " and ") + (node.empty() ? "a program" : "the node '" + node + "'");
        }
        news_.push_back(its.before + names + its.after);
        return true;
    });
    has_news_ = !news_.empty();
}

std::string DriverNews::take() {
    if (!has_news_) return "";
    const std::lock_guard lock(mutex_);
    std::string first = std::move(news_.front());
    news_.erase(news_.begin());
    has_news_ = !news_.empty();
    return first;
}

} // namespace bf::middleware
