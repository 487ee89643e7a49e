// Parameters of a running model as other programs see and change them, whatever carries them.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace bf::middleware {

struct ServedParameter {
    enum class Kind { real, whole, truth };
    static constexpr double infinity = std::numeric_limits<double>::infinity();

    std::string name; ///< such as controller.gain.k
    std::string doc;  ///< with its unit
    Kind kind = Kind::real;
    bool is_scalar = true;
    double minimum = -infinity, maximum = infinity; ///< of each element
    std::string limits;                             ///< in words, where the two do not say all
    std::string fixed;          ///< why it does not change while the model runs; empty: it does
    std::vector<double> values; ///< column by column
};

/// The model's side, for one thread.
class ParameterSource {
  public:
    using Values = std::vector<std::pair<std::string, std::vector<double>>>;
    virtual ~ParameterSource() = default;

    /// All, with their present values.
    virtual std::vector<ServedParameter> parameters() = 0;
    /// Gives them these values before the next step, all or none. Throws std::runtime_error that says why
    /// not.
    virtual void set(const Values& values) = 0;
};

/// The middleware's side, as long as it lives.
class ServedParameters {
  public:
    virtual ~ServedParameters() = default;
};

/// A plugin whose middleware knows parameters has this function, which may throw std::runtime_error; the
/// source outlives what is served:
///   extern "C" bf::middleware::ServedParameters* bf_serve_parameters_v1(bf::middleware::ParameterSource&,
///                                                                       const std::string& where);
inline constexpr const char* parameters_symbol = "bf_serve_parameters_v1";

} // namespace bf::middleware
