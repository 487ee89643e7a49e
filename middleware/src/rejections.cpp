#include "bf/middleware/rejections.hpp"

#include "bf/middleware/clock.hpp"

#include <utility>

namespace bf::middleware {

void Rejections::add(const std::string& topic, std::uint64_t from, const std::string& what, Name node) {
    ++count_;
    constexpr std::size_t most = 10;
    if (known_.size() == most || !known_.insert(std::to_string(from) + topic + what).second) return;
    const std::lock_guard lock(mutex_);
    nameless_.push_back({topic, what, std::move(node), now()});
}

void Rejections::find_names() {
    constexpr double patience = 1; // s
    const std::lock_guard lock(mutex_);
    std::erase_if(nameless_, [&](const Nameless& its) {
        const std::string node = its.node();
        if (node.empty() && now() - its.time < patience) return false;
        news_.push_back("left out what came to the topic '" + its.topic +
                        "': " + (node.empty() ? "a program" : "the node '" + node + "'") + " sends " +
                        its.what + "; so are those that follow");
        return true;
    });
    has_news_ = !news_.empty();
}

std::string Rejections::take() {
    if (!has_news_) return "";
    const std::lock_guard lock(mutex_);
    std::string first = std::move(news_.front());
    news_.erase(news_.begin());
    has_news_ = !news_.empty();
    return first;
}

} // namespace bf::middleware
