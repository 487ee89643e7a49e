// Running again what was recorded and comparing it.
#pragma once

#include "bf/recording/reader.hpp"
#include "bf/run/recorder.hpp"

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace bf {

/// What a recording says of the model that made it. Throws RunError when it does not say it.
ModelSource recorded_source(const recording::Recording& recording);

/// Runs a model as a recording says - with its inputs, its changes of parameters and the outputs of its
/// devices - and compares every recorded signal bit for bit.
class Replay final : public Run::Observer {
  public:
    /// Both outlive the replay. Devices of the run must not run: see play_back_devices.
    Replay(Run& run, const recording::Recording& recording);

    /// Starts the run and restores the last checkpoint not after `from` s; none: from the begin, or
    /// where the recording begins. Throws RunError.
    void start(double from = 0);
    /// One step. False at the end of the recording, after the first difference, and when the model fails.
    bool step();
    /// Also tells the recorder of changed parameters and of checkpoints.
    void record(Recorder& recorder) { recorder_ = &recorder; }

    /// The first difference, e.g. "at 0.25 s 'a.y[1]' is 3, in the recording 3.5"; empty: none. Includes a
    /// model that failed where the recorded one went on.
    const std::string& difference() const { return difference_; }
    std::int64_t samples() const { return samples_; } ///< compared so far
    std::size_t signals() const { return compared_.size(); }
    std::size_t played_back() const { return played_.size(); } ///< signals taken from the recording
    std::int64_t missing() const { return missing_; }          ///< samples that the recording lacks
    double end() const;                                        ///< of the last sample that is compared [s]
    /// The time from which on the recording is one of an edited model, which is not run again; none: it is
    /// not.
    std::optional<double> edited() const { return edited_; }

    void observe(const Run& run) noexcept override;

  private:
    struct Track {
        const recording::Channel* channel;
        Quantity signal;
        std::size_t next = 0; ///< sample
    };
    struct Change {
        std::int64_t step;
        int number;
        std::string name;
        std::vector<double> values;
    };
    std::int64_t time_ns() const;
    void check_times() const;
    void read_changes();
    void find_edit();   ///< after which nothing is compared
    void make_change(); ///< the next one
    void compare(Track& track, bool is_hit);
    void report_missing(const Track& track);

    Run& run_;
    const recording::Recording& recording_;
    Recorder* recorder_ = nullptr;
    std::vector<Track> compared_, played_;
    std::vector<Change> changes_;
    std::size_t next_change_ = 0;
    std::set<std::int64_t> checkpoints_; ///< steps
    std::int64_t restored_ = -1;         ///< the step whose checkpoint was restored
    std::int64_t restored_ns_ = -1;      ///< its time
    std::int64_t end_ns_ = -1, samples_ = 0, missing_ = 0;
    std::optional<double> edited_;
    std::string difference_;
};

} // namespace bf
