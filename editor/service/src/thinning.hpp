#pragma once

#include "bf/run/run.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace bf::service {

/// Of a signal that has more samples than anybody can see, every group of `stride` leaves those that have the
/// least and the greatest value of an element, and its last one. All that it leaves are samples that were.
class Thinning {
  public:
    static constexpr int most_elements = 12; ///< whose extremes are kept: as many as a plot draws

    /// As many samples of `elements` as a group leaves at most.
    static std::size_t most_left(int elements) {
        return 2 * static_cast<std::size_t>(std::min(elements, most_elements)) + 1;
    }

    std::size_t stride = 1;

    /// `keep(time, values)` is called for what is left, in the order of time.
    template <class Keep> void take(double time, const Quantity& quantity, const Keep& keep) {
        const std::size_t n = quantity.info.elements();
        last_.time = time;
        last_.values.resize(n);
        for (std::size_t e = 0; e < n; ++e) last_.values[e] = quantity[static_cast<int>(e)];
        if (taken_++ == 0) {
            if (stride <= 1) return finish(keep);
            extremes_.assign(most_left(static_cast<int>(n)) - 1, last_);
        }
        for (std::size_t e = 0; 2 * e < extremes_.size(); ++e) {
            if (last_.values[e] < extremes_[2 * e].values[e]) extremes_[2 * e] = last_;
            if (last_.values[e] > extremes_[2 * e + 1].values[e]) extremes_[2 * e + 1] = last_;
        }
        if (taken_ >= stride) finish(keep);
    }
    /// The group ends here.
    template <class Keep> void finish(const Keep& keep) {
        if (taken_ == 0) return;
        taken_ = 0;
        extremes_.push_back(last_);
        std::ranges::sort(extremes_, {}, &Sample::time);
        const auto is_same = [](const Sample& a, const Sample& b) { return a.time == b.time; };
        extremes_.erase(std::unique(extremes_.begin(), extremes_.end(), is_same), extremes_.end());
        for (const auto& [at, values] : extremes_) keep(at, values);
        extremes_.clear();
    }

  private:
    struct Sample {
        double time = 0; ///< s
        std::vector<double> values;
    };
    std::size_t taken_ = 0;        ///< of the group
    std::vector<Sample> extremes_; ///< least and greatest of each element
    Sample last_;
};

} // namespace bf::service
