// Where wires run side by side: the order of tracks on one line by the crossings that it costs, then their
// places by distances (nudging; after Wybrow, Marriott, Stuckey, "Orthogonal Connector Routing", Graph
// Drawing 2009). Tracks that touch keep their order, therefore no wire comes to lie on another one.
#include "wires.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace bf::editor::wires {

std::vector<Point> Wire::points(const std::vector<Track>& tracks_of_all) const {
    std::vector<Point> result{start};
    for (std::size_t k = 1; k < tracks.size(); ++k) {
        const Track &a = tracks_of_all[tracks[k - 1]], &b = tracks_of_all[tracks[k]];
        result.push_back(point(a.axis, b.at, a.at));
    }
    result.push_back(end);
    return result;
}

namespace {

/// Where a track of the other axis meets one, and the side, -1 or 1, to which it goes on.
using Joint = std::pair<double, int>;

class Spreading {
  public:
    Spreading(std::vector<Track>& tracks, const std::vector<Wire>& wires, const std::vector<Rectangle>& boxes)
        : tracks_(tracks), wires_(wires), boxes_(boxes) {}

    void run() {
        for (const int axis : {1, 0, 1, 0}) {
            measure();
            place(in_order(axis));
        }
        measure();
    }

  private:
    struct Constraint {
        std::size_t before, after;
    };

    /// Extents and joints, from where the tracks are now.
    void measure() {
        joints_.assign(tracks_.size(), {});
        reach_.assign(tracks_.size(), {-endless, endless});
        for (Track& track : tracks_) track.from = endless, track.to = -endless;
        for (const Wire& wire : wires_) {
            const auto points = wire.points(tracks_);
            for (std::size_t k = 0; k < wire.tracks.size(); ++k) {
                Track& track = tracks_[wire.tracks[k]];
                const double start = along(points[k], track.axis), end = along(points[k + 1], track.axis);
                track.from = std::min({track.from, start, end});
                track.to = std::max({track.to, start, end});
                if (k > 0) join(wire.tracks[k - 1], track.at, start, end);
                if (k + 1 < wire.tracks.size()) join(wire.tracks[k + 1], track.at, end, start);
            }
        }
        for (auto& joints : joints_) {
            std::sort(joints.begin(), joints.end());
            joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
        }
    }

    void join(std::size_t track, double at, double near, double far) {
        joints_[track].emplace_back(at, far > near ? 1 : -1);
        auto& [low, high] = reach_[track];
        if (far > near)
            high = std::min(high, far);
        else
            low = std::max(low, far);
    }

    bool touch(const Track& a, const Track& b) const { return a.from <= b.to && b.from <= a.to; }

    /// How many wires two touching tracks cross where `a` runs above `b`, or left of it.
    int crossings(std::size_t a, std::size_t b) const {
        const Track &first = tracks_[a], &second = tracks_[b];
        if (!touch(first, second)) return 0;
        int result = 0;
        for (const auto& [at, side] : joints_[a]) result += side > 0 && at >= second.from && at <= second.to;
        for (const auto& [at, side] : joints_[b]) result += side < 0 && at >= first.from && at <= first.to;
        return result;
    }

    /// The tracks of an axis by their place; those on one line such that few wires cross.
    std::vector<std::size_t> in_order(int axis) const {
        std::vector<std::size_t> all;
        for (std::size_t t = 0; t < tracks_.size(); ++t)
            if (tracks_[t].axis == axis) all.push_back(t);
        // What is fixed on a line comes first: it stays together, since nothing moves between it.
        std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
            return std::pair(tracks_[a].at, !tracks_[a].is_fixed) <
                   std::pair(tracks_[b].at, !tracks_[b].is_fixed);
        });
        std::vector<std::size_t> result, line;
        for (std::size_t k = 0; k < all.size(); ++k) {
            insert(line, all[k]);
            if (k + 1 < all.size() && tracks_[all[k + 1]].at == tracks_[all[k]].at) continue;
            result.insert(result.end(), line.begin(), line.end());
            line.clear();
        }
        return result;
    }

    void insert(std::vector<std::size_t>& line, std::size_t track) const {
        const auto is_fixed = [&](std::size_t t) { return tracks_[t].is_fixed; };
        int cost = 0;
        for (const std::size_t other : line) cost += crossings(track, other);
        int least = cost;
        std::size_t best = 0;
        for (std::size_t k = 0; k < line.size(); ++k) {
            cost += crossings(line[k], track) - crossings(track, line[k]);
            const bool is_between = is_fixed(line[k]) && k + 1 < line.size() && is_fixed(line[k + 1]);
            if (cost < least && !is_between) least = cost, best = k + 1;
        }
        line.insert(line.begin() + static_cast<std::ptrdiff_t>(best), track);
    }

    /// Which tracks follow each other directly, somewhere along them.
    std::vector<Constraint> constraints(const std::vector<std::size_t>& order) const {
        std::vector<Constraint> result;
        std::map<double, std::size_t> last{{-endless, order.size()}}; // by where it begins
        const auto split = [&](double at) {
            const auto before = std::prev(last.upper_bound(at));
            return before->first == at ? before : last.emplace_hint(std::next(before), at, before->second);
        };
        for (std::size_t k = 0; k < order.size(); ++k) {
            const Track& track = tracks_[order[k]];
            const auto begin = split(track.from - 1);
            const auto end = split(track.to + 1);
            for (auto it = begin; it != end; ++it) {
                if (it->second == order.size()) continue;
                if (track.is_fixed && tracks_[order[it->second]].is_fixed) continue;
                if (result.empty() || result.back().before != it->second || result.back().after != k)
                    result.push_back({it->second, k});
            }
            last.erase(std::next(begin), end);
            begin->second = k;
        }
        return result;
    }

    /// Where a track may run between boxes, and where it would best.
    void limit(const Track& track, double& least, double& most) const {
        for (const Rectangle& box : boxes_) {
            const Rectangle around = widened(box); // since what meets the track moves over it
            if (low(around, track.axis) >= track.to || high(around, track.axis) <= track.from) continue;
            const double before = track.at - high(box, 1 - track.axis),
                         after = low(box, 1 - track.axis) - track.at;
            // Part of the margin is there for when many wires need the room.
            const auto kept = [](double room, double of) { return 0.75 * (room < 0.75 * of ? room : of); };
            const double beneath = track.axis == 0 ? margin_beneath : margin;
            if (before >= 0) least = std::max(least, track.at - before + kept(before, beneath));
            if (after >= 0) most = std::min(most, track.at + after - kept(after, margin));
        }
    }

    void place(const std::vector<std::size_t>& order) {
        const std::size_t n = order.size();
        std::vector<double> least(n, -endless), most(n, endless), gap(n, spacing), at(n);
        for (std::size_t k = 0; k < n; ++k) {
            const Track& track = tracks_[order[k]];
            at[k] = track.at;
            if (track.is_fixed) {
                least[k] = most[k] = track.at;
                continue;
            }
            limit(track, least[k], most[k]);
            const auto [low, high] = reach_[order[k]];
            const double from = std::max(low, least[k]), to = std::min(high, most[k]);
            if (low > -endless && high < endless && from < to) at[k] = (from + to) / 2;
        }
        const auto all = constraints(order);
        const auto distance = [&](const Constraint& c) { return std::min(gap[c.before], gap[c.after]); };

        // Where there is no room for all tracks of a corridor, they come closer to each other.
        std::vector<double> low, high;
        for (int attempt = 0; attempt < 40; ++attempt) {
            low = least, high = most;
            for (const Constraint& c : all)
                low[c.after] = std::max(low[c.after], low[c.before] + distance(c));
            for (std::size_t k = all.size(); k-- > 0;)
                high[all[k].before] = std::min(high[all[k].before], high[all[k].after] - distance(all[k]));
            bool fits = true;
            for (std::size_t k = 0; k < n; ++k)
                if (low[k] > high[k] + 1e-9) gap[k] *= 0.7, fits = false;
            if (fits) break;
        }
        for (std::size_t k = 0; k < n; ++k) at[k] = std::min(std::max(at[k], low[k]), high[k]);
        for (int sweep = 0; sweep < 20; ++sweep)
            for (const Constraint& c : all) {
                const double push = (distance(c) - at[c.after] + at[c.before]) / 2;
                if (push <= 0) continue;
                at[c.before] = std::max(at[c.before] - push, low[c.before]);
                at[c.after] = std::min(at[c.after] + push, high[c.after]);
            }
        low = least;
        std::size_t next = 0;
        for (std::size_t k = 0; k < n; ++k) {
            for (; next < all.size() && all[next].after == k; ++next)
                low[k] = std::max(low[k], at[all[next].before] + distance(all[next]));
            at[k] = std::min(std::max(std::round(at[k]), low[k]), high[k]);
            if (!tracks_[order[k]].is_fixed) tracks_[order[k]].at = at[k];
        }
    }

    static constexpr double endless = std::numeric_limits<double>::infinity();
    std::vector<Track>& tracks_;
    const std::vector<Wire>& wires_;
    const std::vector<Rectangle>& boxes_;
    std::vector<std::vector<Joint>> joints_;       ///< of each track
    std::vector<std::pair<double, double>> reach_; ///< how far the pieces go that meet it
};

} // namespace

void spread(std::vector<Track>& tracks, const std::vector<Wire>& wires, const std::vector<Rectangle>& boxes) {
    Spreading(tracks, wires, boxes).run();
}

} // namespace bf::editor::wires
