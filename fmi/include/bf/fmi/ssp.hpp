// Systems of FMUs as System Structure and Parameterization writes them down: SSP 2.0, of which 1.0 is a part.
#pragma once

#include "bf/fmi/archive.hpp"
#include "bf/fmi/description.hpp"
#include "bf/fmi/instance.hpp"

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace bf::fmi {

/// An end of connections.
struct Connector {
    std::string name;
    Causality kind = Causality::input;
    std::optional<Type> type = {};
    std::string unit = {};
    std::vector<int> dimensions = {};     ///< none: one number; 0: not known
    std::optional<Ticks> ticks = {};      ///< of a clock, where the document says when
    std::vector<std::string> clocks = {}; ///< of its element, in whose ticks alone it has values
};

/// y = factor x + offset.
struct Linear {
    double factor = 1, offset = 0;
    bool operator==(const Linear&) const = default;
};

/// From a connector that gives a value to one that takes it, whichever way the document writes it. An empty
/// element is the system itself.
struct Wire {
    std::string from_element, from, to_element, to;
    Linear conversion = {};               ///< of units, then what the document says
    std::vector<double> xs = {}, ys = {}; ///< corners, mm
};

/// A value for a parameter, row by row; of a text its text.
struct ParameterValue {
    std::string name; ///< relative to the element that it is given to: "controller.Kp"
    Type type = Type::float64;
    std::vector<double> values = {};
    std::string text = {}, unit = {};
    std::vector<int> dimensions = {};
    std::string place = {}; ///< package, document and line that give it
};

/// Corners of a rectangle in mm: x to the right, y upwards. Crossed ones mean that it is flipped.
struct Place {
    double x1, y1, x2, y2;
    double rotation = 0; ///< degrees, counterclockwise
};

/// A component, or a system of elements.
struct SystemElement {
    std::string name, doc = {};
    std::vector<Connector> connectors = {};
    std::optional<Place> place = {};
    std::vector<ParameterValue> parameters = {}; ///< a later one of the same name counts
    std::map<std::string, std::string> own = {}; ///< what BlockFactory notes of it
    std::string source = {};                     ///< of a component: its FMU, a file of the package
    std::optional<Kind> kind = {};               ///< of a component, where the document decides it
    bool is_system = false;
    std::vector<SystemElement> elements = {};
    std::vector<Wire> wires = {};

    const Connector* find(const std::string& connector) const;
};

/// The type of annotations that hold what BlockFactory notes.
inline constexpr const char* own_annotation = "org.blockfactory";

struct SystemStructure {
    std::string name;
    SystemElement system = {};
    std::map<std::string, std::array<int, 8>> units = {}; ///< exponents of kg, m, s, A, K, mol, cd, rad
    bool has_fmi_3 = true;                                ///< is a component of another version than 2.0?
    double start = 0;
    std::optional<double> stop = {};             ///< s
    std::map<std::string, std::string> own = {}; ///< what BlockFactory notes of the experiment
    std::vector<std::string> record = {};        ///< signals, as well
    std::vector<std::string> warnings = {};      ///< of what was read, each with its place
};

/// Reads SystemStructure.ssd in a folder, with the parameter sets and mappings that it names there; `package`
/// is what messages call it. All is taken as hostile. Throws FmuError for what is no such document,
/// contradicts itself, or is not known here: signal dictionaries, components that are no FMUs, indices of
/// arrays.
SystemStructure read_system(const std::filesystem::path& folder, const std::string& package);

/// SystemStructure.ssd, of SSP 1.0 where all that is in it existed there; the values of its parameters are in
/// resources/parameters.ssv.
std::string to_ssd(const SystemStructure& structure);
std::string to_ssv(const SystemStructure& structure);

} // namespace bf::fmi
