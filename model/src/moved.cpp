// Which blocks got other paths.
#include "moved.hpp"

#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"

#include <functional>
#include <utility>

namespace bf::model {

namespace {

using Visit = std::function<void(Block& block, const std::string& path)>;

void each_block(System& system, const std::string& path, const Visit& visit) {
    for (Block& block : system.blocks) {
        const std::string own = joined(path, block.name);
        visit(block, own);
        if (block.system) each_block(*block.system, own, visit);
    }
}

/// What follows `prefix`, which ends where a name does: "a" is in front of "a.b", and of "a(1).b", which is a
/// part of a for_each subsystem.
std::optional<std::string> rest_behind(const std::string& path, const std::string& prefix) {
    if (!path.starts_with(prefix)) return {};
    const std::string rest = path.substr(prefix.size());
    return rest.empty() || rest[0] == '.' || rest[0] == '(' ? std::optional(rest) : std::nullopt;
}

/// The longest of the paths at `here` leads to that at `there`; where nothing leads, and something came from
/// here, nothing is left.
std::optional<std::string> led(const std::vector<Moved>& moves, const std::string& path,
                               std::string Moved::*here, std::string Moved::*there) {
    const Moved* longest = nullptr;
    bool is_left = false;
    for (const Moved& move : moves) {
        if (rest_behind(path, move.*here) && (!longest || (longest->*here).size() < (move.*here).size()))
            longest = &move;
        is_left = is_left || rest_behind(path, move.*there);
    }
    if (longest) return longest->*there + *rest_behind(path, longest->*here);
    return is_left ? std::nullopt : std::optional(path);
}

} // namespace

std::vector<std::string> mark_blocks(Model& model) {
    std::vector<std::string> paths;
    each_block(model.root, "", [&](Block& block, const std::string& path) {
        paths.push_back(path);
        block.mark = static_cast<int>(paths.size());
        if (const auto chart = chart_of(block))
            for (const auto& state : chart->states) {
                paths.push_back(joined(path, state));
                block.state_marks[state] = static_cast<int>(paths.size());
            }
    });
    return paths;
}

std::vector<Moved> moved_blocks(Model& model, const std::vector<std::string>& paths) {
    std::vector<Moved> moves;
    const auto look = [&](int mark, const std::string& path) {
        if (mark == 0) return;
        if (const std::string& before = paths[static_cast<std::size_t>(mark) - 1];
            path_before(moves, path) != before)
            moves.push_back({before, path});
    };
    each_block(model.root, "", [&](Block& block, const std::string& path) {
        look(std::exchange(block.mark, 0), path);
        for (const auto& [state, mark] : std::exchange(block.state_marks, {}))
            look(mark, joined(path, state));
    });
    return moves;
}

void take_marks_away(System& system) {
    each_block(system, "", [](Block& block, const std::string&) {
        block.mark = 0;
        block.state_marks.clear();
    });
}

std::vector<Moved> reversed(std::vector<Moved> moves) {
    for (Moved& move : moves) std::swap(move.from, move.to);
    return moves;
}

std::optional<std::string> path_before(const std::vector<Moved>& moves, const std::string& path) {
    return led(moves, path, &Moved::to, &Moved::from);
}
std::optional<std::string> path_after(const std::vector<Moved>& moves, const std::string& path) {
    return led(moves, path, &Moved::from, &Moved::to);
}

} // namespace bf::model
