#include "c_language.hpp"

#include "names.hpp"

#include <cmath>
#include <map>

namespace bf::codegen {

namespace {

bool is_real(Type type) { return type == Type::float64 || type == Type::float32; }
bool is_signed(Type type) { return type == Type::int8 || type == Type::int16 || type == Type::int32; }

/// Those of <math.h> by our names.
const std::map<std::string, std::string, std::less<>> library{
    {"absolute", "fabs"}, {"sqrt", "sqrt"},   {"exp", "exp"},     {"log", "log"},     {"log10", "log10"},
    {"sin", "sin"},       {"cos", "cos"},     {"tan", "tan"},     {"asin", "asin"},   {"acos", "acos"},
    {"atan", "atan"},     {"sinh", "sinh"},   {"cosh", "cosh"},   {"tanh", "tanh"},   {"asinh", "asinh"},
    {"acosh", "acosh"},   {"atanh", "atanh"}, {"floor", "floor"}, {"ceil", "ceil"},   {"round", "round"},
    {"fmod", "fmod"},     {"fix", "trunc"},   {"atan2", "atan2"}, {"expm1", "expm1"}, {"log1p", "log1p"},
    {"log2", "log2"},     {"hypot", "hypot"}};

/// @T@ is the type, @f@ the suffix of <math.h>, @name@ the function.
const std::map<std::string, std::string, std::less<>> of_all{
    // A call, since GCC 12 makes 0.0 - (double)b the number -0.0 for false: it replaces it by a negation.
    {"number_of", "static @T@ @name@(bool x)\n{\n    return x ? @one@ : @zero@;\n}\n"},
    {"clamp",
     "static @T@ @name@(@T@ x, @T@ lower, @T@ upper)\n{\n    return (x > upper) ? upper : ((x < lower) "
     "? lower : x);\n}\n"}};

const std::map<std::string, std::string, std::less<>> of_reals{
    {"maximum", "static @T@ @name@(@T@ a, @T@ b)\n{\n    return ((a > b) || (isnan(b) != 0)) ? a : b;\n}\n"},
    {"minimum", "static @T@ @name@(@T@ a, @T@ b)\n{\n    return ((a < b) || (isnan(b) != 0)) ? a : b;\n}\n"},
    {"signed_sqrt", "static @T@ @name@(@T@ x)\n{\n    return copysign@f@(sqrt@f@(fabs@f@(x)), x);\n}\n"},
    {"reciprocal_sqrt", "static @T@ @name@(@T@ x)\n{\n    return @one@ / sqrt@f@(x);\n}\n"},
    {"sign", "static @T@ @name@(@T@ x)\n{\n    return (x > @zero@) ? @one@ : ((x < @zero@) ? -@one@ : ((x == "
             "@zero@) ? @zero@ : "
             "x));\n}\n"},
    {"deg2rad", "static @T@ @name@(@T@ x)\n{\n    return @pi@ / @half_turn@ * x;\n}\n"},
    {"rad2deg", "static @T@ @name@(@T@ x)\n{\n    return @half_turn@ / @pi@ * x;\n}\n"},
    {"pow10", "static @T@ @name@(@T@ x)\n{\n    return pow@f@(@ten@, x);\n}\n"},
    {"power", R"(static @T@ @name@(@T@ x, @T@ e)
{
    @T@ y;
    if (e == @one@) {
        y = x;
    } else if (e == @two@) {
        y = x * x;
    } else if (e == -@one@) {
        y = @one@ / x;
    } else {
        y = pow@f@(x, e);
    }
    return y;
}
)"},
    {"remainder", R"(static @T@ @name@(@T@ x, @T@ y)
{
    @T@ r = fmod@f@(x, y);
    if ((r != @zero@) && (y != floor@f@(y))) {
        const @T@ quotient = fabs@f@(x / y);
        if (fabs@f@(quotient - round@f@(quotient)) < (@epsilon@ * quotient)) {
            r = @zero@;
        }
    }
    return r;
}
)"},
    {"modulo", R"(static @T@ @name@(@T@ x, @T@ y)
{
    @T@ r = x;
    if (y != @zero@) {
        r = @needs@(x, y);
        if ((r != @zero@) && ((r < @zero@) != (y < @zero@))) {
            r = r + y;
        }
    }
    return r;
}
)"}};

/// Whole numbers wrap around: the low bits of sum, difference and product do not depend on signs.
const std::map<std::string, std::string, std::less<>> of_whole_numbers{
    {"maximum", "static @T@ @name@(@T@ a, @T@ b)\n{\n    return (a > b) ? a : b;\n}\n"},
    {"minimum", "static @T@ @name@(@T@ a, @T@ b)\n{\n    return (a < b) ? a : b;\n}\n"},
    {"add", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a + (uint32_t)b;\n    "
            "return (@T@)y;\n}\n"},
    {"subtract", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a - (uint32_t)b;\n    "
                 "return (@T@)y;\n}\n"},
    {"multiply", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a * (uint32_t)b;\n    "
                 "return (@T@)y;\n}\n"},
    {"negate",
     "static @T@ @name@(@T@ a)\n{\n    const uint32_t y = 0U - (uint32_t)a;\n    return (@T@)y;\n}\n"}};

const std::map<std::string, std::string, std::less<>> of_signed{
    {"absolute", "static @T@ @name@(@T@ x)\n{\n    const uint32_t y = 0U - (uint32_t)x;\n    return (x < 0) "
                 "? (@T@)y : x;\n}\n"},
    {"remainder", "static @T@ @name@(@T@ x, @T@ y)\n{\n    return (y == 0) ? (@T@)0 : (@T@)((int64_t)x % "
                  "(int64_t)y);\n}\n"},
    {"modulo", R"(static @T@ @name@(@T@ x, @T@ y)
{
    int64_t r = (int64_t)x;
    if (y != 0) {
        r = (int64_t)x % (int64_t)y;
        if ((r != 0) && ((r < 0) != (y < 0))) {
            r += (int64_t)y;
        }
    }
    return (@T@)r;
}
)"},
    {"divide", R"(static @T@ @name@(@T@ a, @T@ b)
{
    int64_t q;
    if (b == 0) {
        q = (a == 0) ? 0 : ((a > 0) ? (int64_t)@max@ : (int64_t)@min@);
    } else {
        q = (int64_t)a / (int64_t)b;
        if ((((int64_t)a % (int64_t)b) != 0) && ((a < 0) != (b < 0))) {
            q--;
        }
    }
    return (@T@)q;
}
)"}};

const std::map<std::string, std::string, std::less<>> of_unsigned{
    {"absolute", "static @T@ @name@(@T@ x)\n{\n    return x;\n}\n"},
    {"remainder", "static @T@ @name@(@T@ x, @T@ y)\n{\n    return (y == 0U) ? (@T@)0 : (@T@)(x % y);\n}\n"},
    {"modulo", "static @T@ @name@(@T@ x, @T@ y)\n{\n    return (y == 0U) ? x : (@T@)(x % y);\n}\n"},
    {"divide",
     "static @T@ @name@(@T@ a, @T@ b)\n{\n    return (b == 0U) ? ((a == 0U) ? (@T@)0 : (@T@)@max@) : "
     "(@T@)(a / b);\n}\n"}};

} // namespace

std::string c_name(Type type) {
    const std::string name = cpp_name(type);
    return name.starts_with("std::") ? name.substr(5) : name;
}

std::string c_literal(double value, Type type) {
    if (!is_real(type) || std::isfinite(value)) return literal(value, type);
    const std::string text = std::isnan(value) ? "NAN" : "INFINITY";
    return (std::signbit(value) && !std::isnan(value) ? "-" : "") + text;
}

std::string c_name(const CFunction& function, const std::string& prefix) {
    const auto& [name, type] = function;
    if (is_real(type))
        if (const auto found = library.find(name); found != library.end())
            return found->second + (type == Type::float32 ? "f" : "");
    return prefix + name + "_" + enumerator(type);
}

std::string c_needs(const CFunction& function) {
    return function.first == "modulo" && is_real(function.second) ? "remainder" : "";
}

std::string c_definition(const CFunction& function, const std::string& prefix) {
    const auto& [name, type] = function;
    if (is_real(type) && library.contains(name)) return {};
    std::string upper = enumerator(type);
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    const Marks marks{{"@T@", c_name(type)},
                      {"@name@", c_name(function, prefix)},
                      {"@needs@", c_name({c_needs(function), type}, prefix)},
                      {"@f@", type == Type::float32 ? "f" : ""},
                      {"@zero@", literal(0, type)},
                      {"@one@", literal(1, type)},
                      {"@two@", literal(2, type)},
                      {"@ten@", literal(10, type)},
                      {"@pi@", literal(std::acos(-1.0), type)},
                      {"@half_turn@", literal(180, type)},
                      {"@epsilon@", type == Type::float32 ? "FLT_EPSILON" : "DBL_EPSILON"},
                      {"@max@", upper + "_MAX"},
                      {"@min@", is_signed(type) ? upper + "_MIN" : "0"}};
    for (const auto* known : {&of_all, is_real(type) ? &of_reals : &of_whole_numbers,
                              is_real(type)     ? &of_reals
                              : is_signed(type) ? &of_signed
                                                : &of_unsigned})
        if (const auto found = known->find(name); found != known->end()) return filled(found->second, marks);
    throw GenerationError("internal error: '" + name + "' has no definition in C");
}

} // namespace bf::codegen
