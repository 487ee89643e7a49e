// What an FMU says of itself: modelDescription.xml of FMI 2.0 and 3.0.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::fmi {

/// An FMU that cannot be used; the text names it, what is wrong, the section of the standard and the remedy.
struct FmuError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

enum class Type {
    float64,
    float32,
    int8,
    uint8,
    int16,
    uint16,
    int32,
    uint32,
    int64,
    uint64,
    boolean,
    string,
    binary,
    clock,
    enumeration
};
enum class Causality {
    parameter,
    calculated_parameter,
    structural_parameter,
    input,
    output,
    local,
    independent
};
enum class Variability { constant, fixed, tunable, discrete, continuous };
enum class Initial { none, exact, approx, calculated };

/// When a clock of FMI 3.0 ticks: section 2.2.9.
struct Ticks {
    enum class Kind { constant, fixed, tunable, changing, countdown, triggered };
    Kind kind = Kind::constant;
    std::optional<double> interval = {}; ///< s; none: the FMU says it at the start, or later
    double shift = 0;                    ///< s, of the first one
    /// Interval and shift as counts of 1 / resolution s; 0: they are not given so.
    std::uint64_t resolution = 0, interval_count = 0, shift_count = 0;
};

struct Variable {
    std::string name, unit = {}, doc = {};
    std::uint32_t reference = 0;
    Type type = Type::float64;
    Causality causality = Causality::local;
    Variability variability = Variability::continuous;
    Initial initial = Initial::none;
    std::vector<int> dimensions = {}; ///< none: one number
    /// Numbers of the structural parameters that dimensions are; -1: a constant.
    std::vector<int> dimension_by = {};
    std::vector<double> start = {}; ///< row by row, or one for all elements; empty: none is given
    std::string text = {};          ///< the start of a string
    std::optional<double> minimum = {}, maximum = {};
    int derivative_of = -1;          ///< number of the variable whose derivative this is
    std::string declared_type = {};  ///< of an enumeration: the one of Description::enumerations
    std::optional<Ticks> ticks = {}; ///< of a clock
    std::vector<int> clocks = {};    ///< numbers of those in whose ticks alone it has values; none: always
    bool has_other_sizes() const {
        return std::any_of(dimension_by.begin(), dimension_by.end(), [](int by) { return by >= 0; });
    }
    int count() const {
        int product = 1;
        for (const int size : dimensions) product *= size;
        return product;
    }
    // As a matrix; more dimensions than two are columns, and what has no elements may have no columns.
    int rows() const { return dimensions.empty() ? 1 : dimensions[0]; }
    int cols() const { return dimensions.size() < 2 ? 1 : count() / std::max(rows(), 1); }
};

/// Where element i of a matrix, counted row by row, stands column by column.
constexpr int column_by_column(int i, int rows, int cols) { return i % cols * rows + i / cols; }

/// A variable that is computed, and what from; without a list, from everything.
struct Unknown {
    int variable; ///< its number
    std::optional<std::vector<int>> dependencies = {};
};

/// What an FMU offers as one kind of interface.
struct Interface {
    std::string identifier; ///< of its library: a C name
    bool has_state = false, can_serialize = false;
    bool has_derivatives = false, has_adjoint = false; ///< directional ones; and those of FMI 3.0
    bool takes_any_step = false, has_event_mode = false, returns_early = false; ///< of co-simulation
    std::optional<double> internal_step = {};                                   ///< s, of co-simulation
    bool needs_completed_step = true;                                           ///< of model exchange
    bool only_once = false;                                                     ///< per process
    bool needs_tool = false;                                                    ///< the one that made it
    std::vector<std::string> sources = {}; ///< to compile, of an FMU of FMI 2.0 with sources
};

/// A type whose values have names.
struct EnumerationType {
    std::string name;
    std::vector<std::pair<double, std::string>> items;
};

/// base = factor x + offset, of the base units with these exponents.
struct UnitDefinition {
    std::array<int, 8> exponents{}; ///< of kg, m, s, A, K, mol, cd, rad
    double factor = 1, offset = 0;
};

struct Description {
    int version = 3; ///< 2 or 3
    std::string name, token, doc = {}, tool = {};
    std::optional<Interface> co_simulation = {}, model_exchange = {};
    double start = 0;
    std::optional<double> stop = {}, step = {};       ///< s
    std::map<std::string, UnitDefinition> units = {}; ///< of what is defined by base units
    std::vector<EnumerationType> enumerations = {};
    std::vector<Variable> variables = {};
    std::vector<Unknown> outputs = {}, derivatives = {}, initial_unknowns = {};
    std::vector<int> indicators = {}; ///< numbers of the variables that are event indicators, of FMI 3.0
    int event_indicators = 0;         ///< how many there are, elements counted
    bool has_clocks() const {
        return std::any_of(variables.begin(), variables.end(),
                           [](const Variable& v) { return v.ticks.has_value(); });
    }
};

/// The same with a variable for each element of an array, "x[2]" and "x[1,2]", as FMI 2.0 has no arrays.
/// References count them through the list from that of the first variable.
Description scalars_of(const Description& description);

std::string to_xml(const Description& description);

/// A name as the structured naming convention of both standards writes it: parts that are no identifiers in
/// quotes, letters outside of ASCII as their bytes of UTF-8: "ü" is '{C3BC}'.
std::string structured_name(const std::string& path);

/// Values of structural parameters, by which arrays have other sizes than the description gives them first.
using Structure = std::map<std::string, double>;

/// Reads the description of an FMU, as which messages name it. It is taken as hostile: throws FmuError for
/// what is no such document, is larger than `description_limit`, or contradicts itself, and for a structure
/// that it has not. Arrays whose size it changes start with zeros, those with one start value for
/// all elements with that; real parameters with NaN, as their values are not known then.
Description read_description(const std::string& xml, const std::string& fmu, const Structure& structure = {});
inline constexpr std::size_t description_limit = 64u << 20u; ///< bytes

} // namespace bf::fmi
