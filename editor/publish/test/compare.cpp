// usage: compare MODEL RECORDING [SECONDS]: runs the model, and tells in one line of JSON how far the signals
// are from the recorded ones; with SECONDS also, of runs without a look in that time, how long the fastest
// took.
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

    void print(const char* name, std::int64_t steps, double seconds) const {
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

/// Time of a run, s; a browser compiles what is used often once more.
double fastest(const bf::Diagram& diagram, double limit) {
    using Clock = std::chrono::steady_clock;
    using Seconds = std::chrono::duration<double>;
    double best = INFINITY;
    for (const auto began = Clock::now(); Seconds(Clock::now() - began).count() < limit;) {
        bf::Simulation run(diagram);
        run.start();
        const auto now = Clock::now();
        run.run_until(run.stop_time());
        best = std::min(best, Seconds(Clock::now() - now).count());
    }
    return best;
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 3) return 2;
    try {
        const bf::LoadedModel loaded = bf::load(std::filesystem::path(argv[1]));
        const auto recording = bf::recording::load(argv[2]);
        bf::Simulation run(loaded.diagram);
        Comparison comparison(run, recording);
        run.add_observer(comparison);
        run.start();
        if (!run.run_until(run.stop_time())) std::fprintf(stderr, "%s\n", run.failure().c_str());
        comparison.print(argv[1], run.steps(), argc > 3 ? fastest(loaded.diagram, std::stod(argv[3])) : 0);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
