// Messages that are left out, and what is told of them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace bf::middleware {

class Rejections {
  public:
    using Name = std::function<std::string()>;
    /// From one thread: `what` the program with that number sends, e.g. "2 numbers for 3 joints". `node`
    /// gives the name of its node; empty: it is not known, or not yet.
    void add(const std::string& topic, std::uint64_t from, const std::string& what, Name node);
    std::uint64_t count() const noexcept { return count_; }
    /// Asks for the names, for at most a second after a message; from a thread that may wait.
    void find_names();
    /// What has its name and nobody was told yet, as a sentence. Empty: nothing. The same of one program is
    /// told once, and ten of them in all, as somebody may send nonsense of many kinds.
    std::string take();

  private:
    struct Nameless {
        std::string topic, what;
        Name node;
        double time; ///< s
    };

    std::atomic<std::uint64_t> count_{0};
    std::set<std::string> known_;
    std::atomic<bool> has_news_{false};
    std::mutex mutex_; ///< of the lists
    std::vector<Nameless> nameless_;
    std::vector<std::string> news_;
};

} // namespace bf::middleware
