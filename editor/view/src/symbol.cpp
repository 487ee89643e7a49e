#include "symbol.hpp"

#include "bf/base/numbers.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string_view>

namespace bf::editor {

namespace {

constexpr double letter = 12;
constexpr double widest = 170; ///< of a text in a block

/// How a type of block is drawn. `text` has {setting} where the value of a setting stands, and a fraction
/// where it has a
/// '\n' after "\f". `curves` are lines of points in a square from (0, 0), the upper left corner, to (1, 1),
/// with '|' between two lines.
struct Look {
    Symbol::Outline outline = Symbol::Outline::rectangle;
    const char* text = nullptr;
    const char* curves = nullptr;
    bool follows_signals = false;
};

using enum Symbol::Outline;

const std::map<std::string_view, Look>& looks() {
    static const std::map<std::string_view, Look> all = {
        // sources
        {"Constant", {rectangle, "{value}"}},
        {"Ground", {rectangle, "0"}},
        {"Clock", {rectangle, "t"}},
        {"Step", {rectangle, nullptr, "0,0.85 0.45,0.85 0.45,0.15 1,0.15"}},
        {"Ramp", {rectangle, nullptr, "0,0.85 0.35,0.85 1,0.1"}},
        {"Sine",
         {rectangle, nullptr,
          "0,0.5 0.06,0.3 0.13,0.14 0.25,0.05 0.37,0.14 0.44,0.3 0.5,0.5 0.56,0.7 0.63,0.86 "
          "0.75,0.95 0.87,0.86 0.94,0.7 1,0.5"}},
        {"Pulse",
         {rectangle, nullptr,
          "0,0.85 0.15,0.85 0.15,0.15 0.4,0.15 0.4,0.85 0.65,0.85 0.65,0.15 0.9,0.15 0.9,0.85 "
          "1,0.85"}},
        {"Chirp",
         {rectangle, nullptr,
          "0,0.5 0.15,0.1 0.35,0.5 0.45,0.9 0.55,0.5 0.62,0.1 0.69,0.5 0.75,0.9 0.8,0.5 "
          "0.85,0.1 0.89,0.5 0.93,0.9 0.96,0.5 1,0.1"}},
        {"SignalGenerator", {rectangle, nullptr, "0,0.9 0.25,0.1 0.5,0.9 0.75,0.1 1,0.9"}},
        {"RepeatingSequence", {rectangle, nullptr, "0,0.9 0.5,0.1 0.5,0.9 1,0.1 1,0.9"}},
        {"RepeatingStair",
         {rectangle, nullptr, "0,0.9 0.25,0.9 0.25,0.5 0.5,0.5 0.5,0.1 0.75,0.1 0.75,0.9 1,0.9"}},
        {"SignalFromFile", {rectangle, "{file}"}},
        {"RandomUniform",
         {rectangle, nullptr,
          "0,0.4 0.2,0.4 0.2,0.8 0.4,0.8 0.4,0.15 0.6,0.15 0.6,0.6 0.8,0.6 0.8,0.3 1,0.3"}},
        {"RandomNormal",
         {rectangle, nullptr, "0,0.9 0.2,0.85 0.35,0.6 0.45,0.2 0.5,0.1 0.55,0.2 0.65,0.6 0.8,0.85 1,0.9"}},
        {"WhiteNoise",
         {rectangle, nullptr,
          "0,0.5 0.1,0.2 0.2,0.7 0.3,0.4 0.4,0.9 0.5,0.1 0.6,0.6 0.7,0.3 0.8,0.8 0.9,0.4 1,0.5"}},
        // arithmetic
        {"Gain", {triangle, "{K}"}},
        {"Bias", {rectangle, "u + {bias}"}},
        {"Negate", {triangle, "−1"}},
        {"Abs", {rectangle, "|u|"}},
        {"Sign", {rectangle, nullptr, "0,0.5 1,0.5|0.5,0 0.5,1|0,0.85 0.5,0.85 0.5,0.15 1,0.15"}},
        {"Square", {rectangle, "u²"}},
        {"Sqrt", {rectangle, "√u"}},
        {"Exp", {rectangle, "eᵘ"}},
        {"Log", {rectangle, "ln"}},
        {"Power", {rectangle, "uᵛ"}},
        {"Reciprocal", {rectangle, "\f1\nu"}},
        {"Hypot", {rectangle, "hypot"}},
        {"Trigonometry", {rectangle, "{function}"}},
        {"SineCosine", {rectangle, "sin\ncos"}},
        {"Atan2", {rectangle, "atan2"}},
        {"Round", {rectangle, "{function}"}},
        {"Fcn", {rectangle, "{expression}"}},
        {"Minimum", {rectangle, "min"}},
        {"Maximum", {rectangle, "max"}},
        {"Mod", {rectangle, "mod"}},
        {"Rem", {rectangle, "rem"}},
        {"Dot", {rectangle, "u · v"}},
        {"Cross", {rectangle, "u × v"}},
        {"Norm", {rectangle, "‖u‖"}},
        {"SumOfElements", {rectangle, "Σ"}},
        {"ProductOfElements", {rectangle, "Π"}},
        {"Transpose", {rectangle, "uᵀ"}},
        {"MatrixInverse", {rectangle, "A⁻¹"}},
        {"PseudoInverse", {rectangle, "A⁺"}},
        {"LinearSolve", {rectangle, "A⁻¹ b"}},
        {"Skew", {rectangle, "[u]×"}},
        {"Identity", {rectangle, "I"}},
        {"Polynomial", {rectangle, "P(u)"}},
        // dynamics
        {"Integrator", {rectangle, "\f1\ns"}},
        {"LimitedIntegrator", {rectangle, "\f1\ns"}},
        {"SecondOrderIntegrator", {rectangle, "\f1\ns²"}},
        {"Derivative", {rectangle, "\fdu\ndt"}},
        {"TransferFunction", {rectangle, "\f{numerator:s}\n{denominator:s}"}},
        {"DiscreteTransferFunction", {rectangle, "\f{numerator:z}\n{denominator:z}"}},
        {"StateSpace", {rectangle, "ẋ = A x + B u\ny = C x + D u"}},
        {"DiscreteStateSpace", {rectangle, "x⁺ = A x + B u\ny = C x + D u"}},
        {"PID", {rectangle, "PID(s)"}},
        {"PID2", {rectangle, "PID(s)"}},
        {"DiscretePID", {rectangle, "PID(z)"}},
        {"DiscretePID2", {rectangle, "PID(z)"}},
        {"DiscreteIntegrator", {rectangle, "\fK T\nz − 1"}},
        {"DiscreteDerivative", {rectangle, "\fΔu\nT"}},
        {"UnitDelay", {rectangle, "z⁻¹"}},
        {"Memory", {rectangle, "z⁻¹"}},
        {"Delay", {rectangle, "z⁻{steps:^}"}},
        {"TappedDelay", {rectangle, "z⁻¹ … z⁻{steps:^}"}},
        {"ZeroPole", {rectangle, "\fK Π(s − z)\nΠ(s − p)"}},
        {"DiscreteZeroPole", {rectangle, "\fK Π(z − z₀)\nΠ(z − p)"}},
        {"FilteredDerivative", {rectangle, "\fs\nτ s + 1"}},
        {"TransportDelay", {rectangle, "e⁻ˢᵀ"}},
        {"FIRFilter", {rectangle, "FIR"}},
        {"DiscreteFilter", {rectangle, "filter"}},
        {"ZeroOrderHold", {rectangle, nullptr, "0,0.9 0.3,0.9 0.3,0.6 0.6,0.6 0.6,0.25 1,0.25"}},
        {"FirstOrderHold", {rectangle, nullptr, "0,0.9 0.3,0.6 0.3,0.7 0.65,0.3 0.65,0.4 1,0.1"}},
        {"RateTransition", {rectangle, "T₁ → T₂"}},
        // discontinuities
        {"Saturate", {rectangle, nullptr, "0,0.5 1,0.5|0.5,0 0.5,1|0,0.85 0.25,0.85 0.75,0.15 1,0.15"}},
        {"SaturateDynamic", {rectangle, nullptr, "0,0.85 0.25,0.85 0.75,0.15 1,0.15"}},
        {"DeadZone", {rectangle, nullptr, "0,0.5 1,0.5|0.5,0 0.5,1|0,0.95 0.33,0.5 0.67,0.5 1,0.05"}},
        {"DeadZoneDynamic", {rectangle, nullptr, "0,0.95 0.33,0.5 0.67,0.5 1,0.05"}},
        {"Quantize",
         {rectangle, nullptr, "0,1 0.2,1 0.2,0.75 0.4,0.75 0.4,0.5 0.6,0.5 0.6,0.25 0.8,0.25 0.8,0 1,0"}},
        {"Relay", {rectangle, nullptr, "0,0.85 0.65,0.85 0.65,0.15 1,0.15|0.35,0.85 0.35,0.15 0.65,0.15"}},
        {"Backlash", {rectangle, nullptr, "0,0.9 0.55,0.9 0.95,0.1 0.45,0.1 0.05,0.9"}},
        {"Friction", {rectangle, nullptr, "0,0.5 1,0.5|0,1 0.5,0.75 0.5,0.25 1,0"}},
        {"RateLimit", {rectangle, nullptr, "0,0.9 0.35,0.9 0.65,0.1 1,0.1"}},
        {"RateLimitDynamic", {rectangle, nullptr, "0,0.9 0.35,0.9 0.65,0.1 1,0.1"}},
        {"HitCrossing", {rectangle, nullptr, "0,0.5 1,0.5|0,0.95 1,0.05"}},
        {"WrapToZero", {rectangle, nullptr, "0,0.9 0.6,0.2 0.6,0.9 1,0.9"}},
        // when blocks run
        {"Iteration", {rectangle, "i"}},
        {"While", {rectangle, "while"}},
        {"If", {rectangle, "if"}},
        {"SwitchCase", {rectangle, "case"}},
        {"FunctionCallGenerator", {rectangle, "f()"}},
        {"InitialCondition", {rectangle, "y(0) = {value}"}},
        {"FirstSample", {rectangle, nullptr, "0,0.15 0.25,0.15 0.25,0.85 1,0.85"}},
        {"SampleHold", {rectangle, nullptr, "0,0.7 0.35,0.7 0.75,0.3|0.75,0.5 1,0.5"}},
        {"OnDelay", {rectangle, nullptr, "0,0.45 0.2,0.45 0.2,0.05 1,0.05|0,0.95 0.6,0.95 0.6,0.55 1,0.55"}},
        {"EdgeDetect", {rectangle, nullptr, "0,0.85 0.5,0.85 0.5,0.15 1,0.15|0.38,0.55 0.5,0.4 0.62,0.55"}},
        {"Counter",
         {rectangle, nullptr, "0,0.95 0.25,0.95 0.25,0.65 0.5,0.65 0.5,0.35 0.75,0.35 0.75,0.05 1,0.05"}},
        {"CounterLimited", {rectangle, "0 … {limit}"}},
        {"CounterFree", {rectangle, "0 … 2ⁿ − 1"}},
        // logic
        {"IntervalTest", {rectangle, nullptr, "0,0.85 0.3,0.85 0.3,0.15 0.7,0.15 0.7,0.85 1,0.85"}},
        {"CombinatorialLogic", {rectangle, "0 1\n1 0"}},
        {"SRFlipFlop", {rectangle, "S R"}},
        {"DFlipFlop", {rectangle, "D"}},
        {"JKFlipFlop", {rectangle, "J K"}},
        {"Bitwise", {rectangle, "bits\n{operator}"}},
        {"ShiftBits", {rectangle, "u · 2ᵏ"}},
        {"Assertion", {rectangle, "u ≠ 0 !"}},
        {"StateMachine",
         {rectangle, nullptr,
          "0,0.1 0.42,0.1 0.42,0.42 0,0.42 0,0.1|0.58,0.58 1,0.58 1,0.9 0.58,0.9 0.58,0.58|0.42,0.26 "
          "0.79,0.26 0.79,0.58"
          "|0.7,0.46 0.79,0.58 0.88,0.46|0.58,0.74 0.21,0.74 0.21,0.42|0.12,0.54 0.21,0.42 0.3,0.54"}},
        {"Logic", {rectangle, "{operator}"}},
        {"Relational", {rectangle, "{operator}"}},
        {"CompareToConstant", {rectangle, "{operator} {constant}"}},
        {"CompareToZero", {rectangle, "{operator} 0"}},
        {"Switch",
         {rectangle, nullptr, "0,0.15 0.4,0.15|0,0.5 0.3,0.5|0,0.85 0.4,0.85|0.4,0.15 0.85,0.5 1,0.5", true}},
        {"MultiportSwitch",
         {rectangle, nullptr, "0,0.15 0.4,0.15|0,0.85 0.4,0.85|0.4,0.5 0.85,0.5 1,0.5", true}},
        {"Merge", {rectangle, "Merge"}},
        // signals
        {"Mux", {bar}},
        {"Demux", {bar}},
        {"Terminator", {rectangle, nullptr, "0,0.5 0.7,0.5|0.7,0.15 0.7,0.85", true}},
        {"Scope",
         {rectangle, nullptr,
          "0.05,0.05 0.95,0.05 0.95,0.95 0.05,0.95 0.05,0.05|0.15,0.7 0.3,0.25 0.5,0.75 0.65,0.35 0.85,0.5"}},
        {"Convert", {rectangle, "{type}"}},
        {"Check", {rectangle, "{kind}"}},
        // tables
        {"Lookup1D", {rectangle, nullptr, "0,0 0,1 1,1|0.05,0.9 0.3,0.75 0.5,0.35 0.7,0.25 1,0.2"}},
        {"Lookup2D",
         {rectangle, nullptr, "0,0.33 1,0.33|0,0.67 1,0.67|0.33,0 0.33,1|0.67,0 0.67,1|0,0 1,0 1,1 0,1 0,0"}},
        {"LookupND",
         {rectangle, nullptr, "0,0.33 1,0.33|0,0.67 1,0.67|0.33,0 0.33,1|0.67,0 0.67,1|0,0 1,0 1,1 0,1 0,0"}},
        {"LookUpRow", {rectangle, "T(u, :)"}},
        {"DirectLookup", {rectangle, "T(i)"}},
        {"Prelookup", {rectangle, "u → k, f"}},
        {"InterpolateAt", {rectangle, "T(k, f)"}},
        // parts of vectors and matrices
        {"Selector", {rectangle, "u({indices})"}},
        {"IndexVector", {rectangle, "u(i)"}},
        {"Assign", {rectangle, "y(i) = u"}},
        {"Width", {rectangle, "n"}},
        {"Reshape", {rectangle, "A(:)"}},
        {"Submatrix", {rectangle, "A(i, j)"}},
        {"ConcatenateMatrices", {rectangle, "[A B]"}},
        {"BlockDiagonal", {rectangle, "diag(A, B)"}},
        {"DiagonalMatrix", {rectangle, "diag(u)"}},
        {"DiagonalOf", {rectangle, "diag(A)"}},
        {"RunningExtreme", {rectangle, "{function} u"}},
        {"CumulativeSum", {rectangle, "Σ₁ⁿ u"}},
        {"Sort",
         {rectangle, nullptr,
          "0,0.95 0.2,0.95 0.2,0.75|0.2,0.95 0.4,0.95 0.4,0.55|0.4,0.95 0.6,0.95 0.6,0.35|0.6,0.95 0.8,0.95 "
          "0.8,0.1"}},
        {"FindFirst", {rectangle, "u ≠ 0 → i"}},
        {"Display",
         {rectangle, nullptr,
          "0,0.2 1,0.2 1,0.8 0,0.8 0,0.2|0.15,0.35 0.3,0.35 0.3,0.65 0.15,0.65 0.15,0.35|0.4,0.62 0.4,0.66"
          "|0.5,0.35 0.65,0.35 0.65,0.65|0.75,0.35 0.9,0.35 0.75,0.65 0.9,0.65"}},
        // geometry
        {"RotationFromRollPitchYaw", {rectangle, "rpy → R"}},
        {"RollPitchYawFromRotation", {rectangle, "R → rpy"}},
        {"RotationAboutAxis", {rectangle, "R({axis}, θ)"}},
        {"QuaternionFromRotation", {rectangle, "R → q"}},
        {"RotationFromQuaternion", {rectangle, "q → R"}},
        {"RotationVectorFromRotation", {rectangle, "log R"}},
        {"RotationFromRotationVector", {rectangle, "exp [θ]×"}},
        {"RotationError", {rectangle, "R₁ R₂ᵀ → e"}},
        {"InversePose", {rectangle, "H⁻¹"}},
        {"ComposePoses", {rectangle, "H₁ H₂"}},
        {"PosePosition", {rectangle, "H → p"}},
        {"PoseRotation", {rectangle, "H → R"}},
        {"PoseFromParts", {rectangle, "R, p → H"}},
        // robots
        {"WholeBodyToolbox/MassMatrix", {rectangle, "M"}},
        {"WholeBodyToolbox/GetBiasForces", {rectangle, "h"}},
        {"WholeBodyToolbox/GetGravityForces", {rectangle, "g"}},
        {"WholeBodyToolbox/GetCoriolisForces", {rectangle, "c"}},
        {"WholeBodyToolbox/CoriolisMatrix", {rectangle, "C"}},
        {"WholeBodyToolbox/MassMatrixDerivative", {rectangle, "Ṁ"}},
        {"WholeBodyToolbox/DotANu", {rectangle, "Ȧ ν"}},
        {"WholeBodyToolbox/ForwardDynamics", {rectangle, "τ → ν̇"}},
        {"WholeBodyToolbox/InverseKinematics", {rectangle, "w_H_f → s"}},
        {"WholeBodyToolbox/Jacobian", {rectangle, "J\n{frame}"}},
        {"WholeBodyToolbox/DotJNu", {rectangle, "J̇ ν\n{frame}"}},
        {"WholeBodyToolbox/ForwardKinematics", {rectangle, "w_H_b → w_H_f\n{frame}"}},
        {"WholeBodyToolbox/CentroidalMomentum", {rectangle, "L"}},
        {"WholeBodyToolbox/CenterOfMass", {rectangle, "CoM"}},
        {"WholeBodyToolbox/GetMeasurement", {rectangle, "measure\n{measured_type}"}},
        {"WholeBodyToolbox/GetSensor", {rectangle, "sense\n{sensor}"}},
        {"WholeBodyToolbox/SetReferences", {rectangle, "command\n{control_type}"}},
        {"WholeBodyToolbox/InverseDynamics", {rectangle, "ν̇ → τ"}},
        {"WholeBodyToolbox/CentroidalTotalMomentumMatrix", {rectangle, "A"}},
        {"WholeBodyToolbox/RelativeTransform", {rectangle, "f₁_H_f₂"}},
        {"WholeBodyToolbox/RelativeJacobian", {rectangle, "J\n{frame}"}},
        {"WholeBodyToolbox/GetLimits", {rectangle, "limits\n{limit_type}"}},
        {"WholeBodyToolbox/CartesianTask", {rectangle, "task\n{frame}"}},
        {"WholeBodyToolbox/CenterOfMassTask", {rectangle, "task\nCoM"}},
        {"WholeBodyToolbox/MomentumTask", {rectangle, "task\nL"}},
        {"WholeBodyToolbox/PostureTask", {rectangle, "task\ns"}},
        {"WholeBodyToolbox/RigidContact", {rectangle, "contact\n{frame}"}},
        {"WholeBodyToolbox/ContactLimits", {rectangle, "A f ≤ b"}},
        {"WholeBodyToolbox/JointLimits", {rectangle, "A ν̇ ≤ b"}},
        {"WholeBodyToolbox/HierarchicalQP", {rectangle, "QP₁, QP₂, …"}},
        {"WholeBodyToolbox/TaskSpaceInverseDynamics", {rectangle, "tasks → τ"}},
        {"WholeBodyToolbox/FootstepPlanner", {rectangle, "footsteps"}},
        {"WholeBodyToolbox/DcmPlanner", {rectangle, "ξ plan"}},
        {"WholeBodyToolbox/DcmController", {rectangle, "ξ → c̈"}},
        {"WholeBodyToolbox/SwingFoot", {rectangle, "swing foot"}},
        {"WholeBodyToolbox/StreamRead", {rectangle, "read\n{stream}"}},
        {"WholeBodyToolbox/StreamWrite", {rectangle, "write\n{stream}"}},
        {"WholeBodyToolbox/DampPinv", {rectangle, "A⁺"}},
        {"WholeBodyToolbox/TruncPinv", {rectangle, "A⁺"}},
        {"WholeBodyToolbox/MujocoWorld", {rectangle, "world"}},
        {"WholeBodyToolbox/World", {rectangle, "world\n{file}"}},
        {"WholeBodyToolbox/WorldRobot", {rectangle, "robot\n{robot}"}},
        {"WholeBodyToolbox/WorldObject", {rectangle, "object\n{object}"}},
        {"WholeBodyToolbox/WorldPush", {rectangle, "push\n{link}"}},
        {"WholeBodyToolbox/WorldActuator", {rectangle, "drive\n{actuator}"}},
        {"WholeBodyToolbox/WorldRays", {rectangle, "rays"}},
        {"WholeBodyToolbox/WorldContact", {rectangle, "contact\n{body}"}},
        {"WholeBodyToolbox/WorldTactile", {rectangle, "touch\n{body}"}},
        {"WholeBodyToolbox/QP", {rectangle, "QP"}},
        {"WholeBodyToolbox/QpOases", {rectangle, "qpOASES"}},
        {"WholeBodyToolbox/OSQP", {rectangle, "OSQP"}},
        {"WholeBodyCameras/WorldCamera", {rectangle, "camera"}},
    };
    return all;
}

/// Without the quotes of a MATLAB text.
std::string bare(std::string text) {
    if (text.size() >= 2 && text.front() == text.back() && (text.front() == '\'' || text.front() == '"'))
        text = text.substr(1, text.size() - 2);
    return text;
}

/// The number as an exponent, or n.
std::string superscript(const std::string& number) {
    static const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text;
    for (const char c : number)
        if (c < '0' || c > '9')
            return "ⁿ";
        else
            text += digits[c - '0'];
    return text.empty() ? "ⁿ" : text;
}

/// Operators as they are printed.
std::string printed(const std::string& text) {
    static const std::map<std::string_view, const char*> all = {
        {"<=", "≤"}, {">=", "≥"}, {"==", "="}, {"~=", "≠"}};
    const auto found = all.find(text);
    return found == all.end() ? text : found->second;
}

/// The numbers of a row, one after the other; none where it is anything else.
std::vector<double> numbers_of(std::string text) {
    if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
    std::istringstream words(text);
    std::vector<double> numbers;
    for (std::string word; words >> word;) {
        const auto number = number_of(word);
        if (!number || !std::isfinite(*number)) return {};
        numbers.push_back(*number);
    }
    return numbers;
}

/// Puts settings in the place of {name}, polynomials in that of {name:variable}, exponents in that of
/// {name:^}.
std::string filled(std::string_view text, const SettingText& setting) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = text[at] == '{' ? text.find('}', at) : std::string_view::npos;
        if (end == std::string_view::npos) {
            result += text[at++];
            continue;
        }
        const std::string_view inside = text.substr(at + 1, end - at - 1);
        const auto colon = inside.find(':');
        std::string value = printed(bare(setting(std::string(inside.substr(0, colon)))));
        const std::string how(colon == std::string_view::npos ? std::string_view()
                                                              : inside.substr(colon + 1));
        if (!how.empty()) value = how == "^" ? superscript(value) : polynomial(value, how);
        std::replace(value.begin(), value.end(), '\n', ' ');
        if (result.ends_with("+ ") && value.starts_with('-') && number_of(value)) {
            result.replace(result.size() - 2, 2, "− "); // a sum of a negative number is a difference
            value.erase(0, 1);
        }
        result += value;
        at = end + 1;
    }
    return result;
}

Shape text_shape(Point at, std::string text, double size) {
    return {Shape::Kind::text, Style::value, {at}, std::move(text), size, Align::middle};
}

/// Lines of text in the middle of the symbol, or a fraction.
void add_text(Symbol& symbol, std::string text) {
    const bool is_fraction = text.starts_with('\f');
    if (is_fraction) text.erase(0, 1);
    std::vector<std::string> lines;
    std::istringstream all(text);
    for (std::string line; std::getline(all, line);) lines.push_back(fitted(line, letter, widest));
    double width = 0;
    for (const auto& line : lines) width = std::max(width, text_width(line, letter));
    // A triangle is as high as a letter up to two thirds of its width.
    const double needed = symbol.outline == triangle ? std::max(width + 26, width / 0.64) : width + 16;
    symbol.width = std::max(symbol.width, std::ceil(needed / 10) * 10);
    constexpr double line_height = 16;
    // Whole tens put pins on the grid of 5.
    symbol.height =
        std::max(symbol.height, std::ceil((static_cast<double>(lines.size()) * line_height + 14) / 10) * 10);
    // A triangle is wide where signals come in.
    if (symbol.outline == triangle) symbol.middle.x = -symbol.width * 0.14;
    const double x = symbol.width / 2 + symbol.middle.x;
    const double first = symbol.height / 2 - static_cast<double>(lines.size()) * line_height / 2;
    for (std::size_t i = 0; i < lines.size(); ++i)
        symbol.shapes.push_back(
            text_shape({x, first + (static_cast<double>(i) + 0.76) * line_height}, lines[i], letter));
    if (is_fraction)
        symbol.shapes.push_back(
            {Shape::Kind::line,
             Style::symbol,
             {{x - width / 2 - 3, symbol.height / 2}, {x + width / 2 + 3, symbol.height / 2}}});
}

/// The lines of a look, in a square in the middle of the symbol.
void add_curves(Symbol& symbol, const char* curves) {
    const double side = 24;
    const Point corner{(symbol.width - side) / 2, (symbol.height - side) / 2};
    std::istringstream all{std::string(curves)};
    for (std::string curve; std::getline(all, curve, '|');) {
        Shape line{Shape::Kind::line, Style::symbol, {}};
        std::istringstream points(curve);
        for (double x = 0, y = 0; points >> x;) {
            char comma = 0;
            points >> comma >> y;
            line.points.push_back({corner.x + side * x, corner.y + side * y});
        }
        symbol.shapes.push_back(std::move(line));
    }
}

/// The points of a function of one variable, as curves of a look; empty where they are no plain numbers.
std::string table_curve(const SettingText& setting) {
    const std::vector<double> x = numbers_of(setting("breakpoints")), y = numbers_of(setting("table"));
    if (x.size() != y.size() || x.size() < 2 || x.size() > 200) return {};
    const double low = *std::min_element(y.begin(), y.end()), high = *std::max_element(y.begin(), y.end());
    const double width = x.back() - x.front(), height = high - low;
    if (!(width > 0) || !std::isfinite(width) || !std::isfinite(height)) return {};
    const bool is_flat = bare(setting("interpolation")) == "flat";
    std::string text = "0,0 0,1 1,1|"; // axes
    for (std::size_t i = 0; i < x.size(); ++i) {
        const auto point = [&](double at, double value) {
            const double share = height > 0 ? (value - low) / height : 0.5;
            text += number_text(std::clamp((at - x.front()) / width, 0.0, 1.0)) + "," +
                    number_text(0.95 - 0.9 * share) + " ";
        };
        if (is_flat && i > 0) point(x[i], y[i - 1]);
        point(x[i], y[i]);
    }
    return text;
}

/// A + or - per input, a * or / per input: of blocks that say so, or the number of inputs.
std::string operators(const std::string& text, char usual, std::size_t rows) {
    std::string signs;
    for (const char c : bare(text))
        if (c == '+' || c == '-' || c == '*' || c == '/') signs += c;
    return signs.empty() ? std::string(rows, usual) : signs;
}

/// Signs as they are read: "+−", "×÷".
std::vector<std::string> signs_of(const std::string& operations) {
    std::vector<std::string> signs;
    for (const char c : operations)
        signs.emplace_back(c == '-' ? "−" : c == '*' ? "×" : c == '/' ? "÷" : "+");
    return signs;
}

/// A rectangle whose corners are quarters of circles: Bézier curves, whose control points stand 4/3 tan(π/8)
/// of a radius away from the ends of a quarter.
Shape rounded_shape(double w, double h, double r) {
    Shape shape{Shape::Kind::curve, Style::body, {{r, 0}}};
    const double k = r * 4 / 3 * std::tan(std::acos(-1.0) / 8);
    const auto go = [&](Point a, Point b, Point end) {
        shape.points.insert(shape.points.end(), {a, b, end});
    };
    const auto line = [&](Point end) { go(shape.points.back(), end, end); };
    line({w - r, 0});
    go({w - r + k, 0}, {w, r - k}, {w, r});
    line({w, h - r});
    go({w, h - r + k}, {w - r + k, h}, {w - r, h});
    line({r, h});
    go({r - k, h}, {0, h - r + k}, {0, h - r});
    line({0, r});
    go({0, r - k}, {r - k, 0}, {r, 0});
    return shape;
}

} // namespace

std::string polynomial(const std::string& coefficients, const std::string& variable) {
    const std::vector<double> values = numbers_of(coefficients);
    static const char* const powers[] = {"", "", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    if (values.empty() || values.size() > std::size(powers)) return coefficients;
    std::string text;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t power = values.size() - 1 - i;
        if (values[i] == 0) continue;
        const double size = std::abs(values[i]);
        text += text.empty() ? (values[i] < 0 ? "−" : "") : values[i] < 0 ? " − " : " + ";
        if (size != 1 || power == 0) text += number_text(size);
        if (power > 0) text += (size != 1 ? " " : "") + variable + powers[power];
    }
    return text.empty() ? "0" : text;
}

Symbol symbol_of(const std::string& type, std::size_t rows, const SettingText& setting) {
    Symbol symbol{rectangle, 40, 40};
    symbol.height = std::max(symbol.height, static_cast<double>(rows) * port_gap + 10);
    if (type == "Sum" || type == "Product") {
        const std::string signs =
            operators(setting(type == "Sum" ? "signs" : "operations"), type == "Sum" ? '+' : '*', rows);
        if (type == "Sum" && (signs == "+-" || signs == "-+")) symbol = {circle, 30, 30};
        if (rows > 1)
            symbol.signs = signs_of(signs);
        else
            add_text(symbol, type == "Sum" ? "Σ" : "Π");
        return symbol;
    }
    const auto known = looks().find(type);
    if (known == looks().end()) {
        add_text(symbol, type.substr(type.rfind('/') + 1));
        return symbol;
    }
    const Look& look = known->second;
    symbol.outline = look.outline;
    symbol.follows_signals = look.follows_signals;
    if (look.outline == bar) {
        symbol.width = 6;
        return symbol;
    }
    if (look.text) {
        std::string text = filled(look.text, setting);
        while (text.ends_with('\n')) text.pop_back();
        add_text(symbol, std::move(text));
    }
    const std::string points = type == "Lookup1D" ? table_curve(setting) : "";
    if (look.curves) add_curves(symbol, points.empty() ? look.curves : points.c_str());
    return symbol;
}

std::vector<Shape> outline_shapes(Symbol::Outline outline, double width, double height, model::Side to) {
    const double w = width, h = height;
    switch (outline) {
    case rectangle: return {{Shape::Kind::polygon, Style::body, {{0, 0}, {w, 0}, {w, h}, {0, h}}}};
    case bar: return {{Shape::Kind::polygon, Style::branch, {{0, 0}, {w, 0}, {w, h}, {0, h}}}};
    case triangle:
        switch (to) {
        case model::Side::left: return {{Shape::Kind::polygon, Style::body, {{w, 0}, {w, h}, {0, h / 2}}}};
        case model::Side::right: return {{Shape::Kind::polygon, Style::body, {{0, 0}, {w, h / 2}, {0, h}}}};
        case model::Side::top: return {{Shape::Kind::polygon, Style::body, {{0, h}, {w / 2, 0}, {w, h}}}};
        case model::Side::bottom: return {{Shape::Kind::polygon, Style::body, {{0, 0}, {w, 0}, {w / 2, h}}}};
        }
        return {};
    case circle: return {{Shape::Kind::ellipse, Style::body, {{0, 0}, {w, h}}}};
    case pill: return {rounded_shape(w, h, h / 2)};
    case rounded: return {rounded_shape(w, h, std::min(10.0, h / 2))};
    }
    return {};
}

} // namespace bf::editor
