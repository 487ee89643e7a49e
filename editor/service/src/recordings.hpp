#pragma once

#include "bf/recording/reader.hpp"
#include "bf/service/protocol.hpp"
#include "bf/service/worker.hpp"

#include <atomic>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace bf::service {

/// The recordings that pages compare with the run, each read beside the service and beside the others: one
/// from elsewhere may take long. The last few stay open.
class Recordings {
  public:
    using Post = std::function<void(std::function<void()>)>;

    /// `post` runs a task in the thread of the service, later; `tell` is called there when a recording has
    /// been read, and when it cannot be.
    Recordings(Post post, std::function<void(const Recorded&)> tell);
    ~Recordings(); ///< gives up what is being read

    /// Returns the number of the recording. Throws std::runtime_error while too many are being read.
    int read(int page, const std::filesystem::path& file, const std::string& name);
    void close(int number); ///< gives it up, where it is still being read
    void leave(int page);   ///< what that page waits for is given up
    /// All samples of signal "RECORDING/INDEX", as pieces of a binary frame, where that is what pages were
    /// told.
    std::optional<std::string> samples(std::string_view what) const;

  private:
    struct Opened {
        Opened(int n, int p) : number(n), page(p) {}
        const int number, page;
        std::atomic<bool> is_given_up = false;
        std::optional<recording::Recording> recording = {};          ///< once it is read
        std::unique_ptr<Worker> reader = std::make_unique<Worker>(); ///< until then; last: it uses the others
    };
    void take(Recorded told, std::optional<recording::Recording> found);
    template <class Which> void give_up(const Which& which);

    const Post post_;
    const std::function<void(const Recorded&)> tell_;
    std::list<Opened> opened_;
    int number_ = 0;
};

/// All samples of a signal of that index, as pieces of a binary frame.
void append_samples(std::string& frame, int index, const recording::Channel& channel);

/// How the protocol calls a signal.
SignalInfo described(int index, const std::string& path, const recording::ChannelInfo& info);

} // namespace bf::service
