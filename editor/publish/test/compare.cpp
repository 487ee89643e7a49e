// usage: compare MODEL RECORDING: runs the model as it was run for the recording, and tells in one line of
// JSON how far the signals are from the recorded ones, and how long the run took.
#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"
#include "bf/recording/reader.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace {

/// A recorded signal, and the same one here.
struct Track {
    const bf::recording::Channel* channel;
    bf::Quantity signal;
    std::size_t next = 0; ///< sample
    double difference = 0, largest = 0;
    bool is_same = true; ///< bit for bit
};

class Comparison final : public bf::Run::Observer {
  public:
    Comparison(const bf::Run& run, const bf::recording::Recording& recording) {
        const auto signals = run.signals();
        for (const auto& channel : recording.channels)
            if (const auto& signal = find(signals, channel.name); signal.rate != bf::constant_rate)
                tracks_.push_back({&channel, signal});
    }

    void observe(const bf::Run& run) noexcept override {
        for (auto& track : tracks_)
            if (run.is_hit(track.signal.rate)) compare(track);
    }

    void print(const char* name, double seconds, std::int64_t steps) const {
        std::size_t samples = 0, same = 0;
        double largest = 0;
        const Track* worst = nullptr;
        bool has_all = true;
        for (const auto& track : tracks_) {
            samples += track.next;
            same += track.is_same;
            has_all &= track.next == track.channel->samples();
            const double relative = track.difference / std::max(track.largest, 1e-300);
            if (track.difference > 0 && relative > largest) largest = relative, worst = &track;
        }
        std::printf(
            "{\"model\": \"%s\", \"signals\": %zu, \"samples\": %zu, \"identical\": %zu, \"complete\": %s, "
            "\"difference\": %.3g, \"worst\": \"%s\", \"steps\": %lld, \"seconds\": %.6f}\n",
            name, tracks_.size(), samples, same, has_all ? "true" : "false", largest,
            worst ? worst->channel->name.c_str() : "", static_cast<long long>(steps), seconds);
    }

  private:
    static void compare(Track& track) {
        const auto& channel = *track.channel;
        const std::size_t k = track.next++;
        if (k >= channel.samples()) return;
        for (std::size_t i = 0; i < channel.info.elements(); ++i) {
            const double here = track.signal[static_cast<int>(i)], there = channel.value(k, i);
            if (std::memcmp(&here, &there, sizeof here) == 0 || (std::isnan(here) && std::isnan(there))) {
                track.largest = std::max(track.largest, std::abs(there));
                continue;
            }
            track.is_same = false;
            track.difference = std::max(track.difference, std::abs(here - there));
            track.largest = std::max(track.largest, std::abs(there));
        }
    }

    std::vector<Track> tracks_;
};

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    try {
        const bf::LoadedModel loaded = bf::load(std::filesystem::path(argv[1]));
        const auto recording = bf::recording::load(argv[2]);
        bf::Simulation timed(loaded.diagram), compared(loaded.diagram);
        timed.start();
        const auto began = std::chrono::steady_clock::now();
        timed.run_until(timed.stop_time());
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;

        Comparison comparison(compared, recording);
        compared.add_observer(comparison);
        compared.start();
        if (!compared.run_until(compared.stop_time()))
            std::fprintf(stderr, "%s\n", compared.failure().c_str());
        comparison.print(argv[1], took.count(), timed.steps());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
