#pragma once

#include "bf/model/model.hpp"

#include <string>
#include <vector>

namespace bf::model {

/// One thing in which two models differ.
struct Distinction {
    enum class Kind { added, removed, changed, renamed };
    Kind kind = Kind::changed;
    /// The block, port, wire or subsystem that it concerns, by the names of the later model; a wire has the
    /// path of the input it leads to. Empty: the model itself.
    std::string path;
    std::string system; ///< path of the subsystem in which that stands
    std::string what;   ///< "wire", "input", "setting K", "variable Kp", "step"; empty: the block itself
    std::string before = {}, after = {}; ///< as the documents write it, empty where nothing is written

    bool operator==(const Distinction&) const = default;
};

/// Finds what a reader of `after` who knows `before` has to be told, in the order of `after`: nothing where
/// both are equal by meaning. Blocks, ports, variables and wires are matched by their names. A block is
/// renamed that differs by its name alone, or that is the only new one where one of its kind is gone; what
/// refers to it follows. Looks into referenced files. Of the layout, one line says how much is drawn
/// elsewhere.
std::vector<Distinction> compare(const Model& before, const Model& after);

/// Where that stood in the earlier model which now stands at `path`, if blocks around it were renamed.
std::string earlier_path(std::string path, const std::vector<Distinction>& distinctions);

/// In one line: "~ controller.pd: setting K: 2 -> 3".
std::string text_of(const Distinction& distinction);

} // namespace bf::model
