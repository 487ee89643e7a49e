#pragma once

#include "bf/recording/reader.hpp"
#include "bf/service/protocol.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bf::service {

/// The recordings that pages compare with the run. The last few stay open.
class Recordings {
  public:
    /// Throws std::runtime_error when the file is no recording.
    Recorded open(const std::filesystem::path& file, const std::string& name);
    /// All samples of signal "RECORDING/INDEX", as pieces of a binary frame, where that is what pages were
    /// told.
    std::optional<std::string> samples(std::string_view what) const;

  private:
    struct Opened {
        int number;
        recording::Recording recording;
    };
    std::vector<Opened> opened_;
    int number_ = 0;
};

/// All samples of a signal of that index, as pieces of a binary frame.
void append_samples(std::string& frame, int index, const recording::Channel& channel);

/// How the protocol calls a signal.
SignalInfo described(int index, const std::string& path, const recording::ChannelInfo& info);

} // namespace bf::service
