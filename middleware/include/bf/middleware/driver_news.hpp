// What is told of the programs that drive a served robot.
#pragma once

#include "bf/middleware/turns.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace bf::middleware {

class DriverNews {
  public:
    // In the thread of the middleware. Programs have numbers there.
    /// A command came, and was taken.
    void came(std::uint64_t from);
    /// One was left out, which takes the robot from nobody: `what` the program sends, e.g. "2 numbers, but
    /// the joints are hip, knee, ankle".
    void left_out(const std::string& topic, std::uint64_t from, const std::string& what);

    std::uint64_t rejected() const noexcept { return rejected_; } ///< how many were left out
    /// Asks for the names of nodes, for at most a second after a message; from a thread that may wait. Empty:
    /// a name is not known, or not yet.
    void find_names(const std::function<std::string(std::uint64_t program)>& node_of);
    /// What has its names and nobody was told yet, as a sentence. Empty: nothing. That two programs command
    /// by turns is told once, as is the same message of one program, and ten of these in all, as somebody may
    /// send nonsense of many kinds.
    std::string take();

  private:
    struct Nameless {
        std::string before, after; ///< around the names
        std::vector<std::uint64_t> who;
        double time; ///< s
    };
    void tell(Nameless what);

    Turns turns_;
    bool are_two_told_ = false;
    std::atomic<std::uint64_t> rejected_{0};
    std::set<std::string> known_; ///< of what was left out
    std::atomic<bool> has_news_{false};
    std::mutex mutex_; ///< of the lists
    std::vector<Nameless> nameless_;
    std::vector<std::string> news_;
};

} // namespace bf::middleware
