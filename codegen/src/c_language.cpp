#include "c_language.hpp"

#include "bf/codegen/generate.hpp"
#include "names.hpp"

#include <array>
#include <cmath>

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

const CDefinitions of_all{
    // A call, since GCC 12 makes 0.0 - (double)b the number -0.0 for false: it replaces it by a negation.
    {"number_of", "static @T@ @name@(bool x)\n{\n    return x ? @one@ : @zero@;\n}\n"},
    {"clamp",
     "static @T@ @name@(@T@ x, @T@ lower, @T@ upper)\n{\n    return (x > upper) ? upper : ((x < lower) "
     "? lower : x);\n}\n"}};

const CDefinitions of_reals{
    {"to_nearest", R"(static @T@ @name@(@T@ x)
{
    const @T@ below = floor@f@(x);
    return ((x - below) >= @half@) ? (below + @one@) : below;
}
)"},
    {"to_even", R"(static @T@ @name@(@T@ x)
{
    const @T@ below = floor@f@(x);
    const @T@ part = x - below;
    const bool is_down = (part < @half@) || ((part == @half@) && (fmod@f@(below, @two@) == @zero@));
    return (is_down || (isnan(part) != 0)) ? below : (below + @one@);
}
)"},
    // Philox4x32-10 of the seed, the number of draws and the element: the same numbers on every machine.
    {"uniform", R"(static @T@ @name@(uint32_t seed, const uint32_t *count, uint32_t element, bool is_second)
{
    uint32_t word[4] = {count[0], count[1], element, 0U};
    uint32_t key[2] = {seed, 0U};
    for (int round = 0; round < 10; ++round) {
        const uint64_t a = 0xD2511F53ULL * word[0];
        const uint64_t b = 0xCD9E8D57ULL * word[2];
        word[0] = (uint32_t)(b >> 32U) ^ word[1] ^ key[0];
        word[1] = (uint32_t)(b & 0xFFFFFFFFULL);
        word[2] = (uint32_t)(a >> 32U) ^ word[3] ^ key[1];
        word[3] = (uint32_t)(a & 0xFFFFFFFFULL);
        key[0] += 0x9E3779B9U;
        key[1] += 0xBB67AE85U;
    }
    if (is_second) {
        word[0] = word[2];
        word[1] = word[3];
    }
    @draw@
}
)"},
    {"normal", R"(static @T@ @name@(@T@ variance, uint32_t seed, const uint32_t *count, uint32_t element)
{
    const @T@ radius = sqrt@f@(-@two@ * log@f@(@one@ - @uniform@(seed, count, element, false)));
    const @T@ angle = @two@ * @pi@ * @uniform@(seed, count, element, true);
    return sqrt@f@(variance) * radius * cos@f@(angle);
}
)"},
    // The k with points[k] <= at < points[k + 1], of the first or last two beyond the ends, and the part of
    // the way between the two.
    {"piece", R"(static int32_t @name@(const @T@ *points, int32_t n, @T@ at, bool clips, @T@ *part)
{
    int32_t low = 0;
    int32_t high = n - 1;
    @T@ f = (isnan(at) != 0) ? at : @zero@;
    while ((high - low) > 1) {
        const int32_t middle = low + ((high - low) / 2);
        if (at >= points[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    if (n > 1) {
        f = (at - points[low]) / (points[low + 1] - points[low]);
    }
    if (clips && (f > @one@)) {
        f = @one@;
    }
    if (clips && (f < @zero@)) {
        f = @zero@;
    }
    *part = f;
    return low;
}
)"},
    // The table's value between the elements from `places` on, along straight lines, the last dimension
    // first.
    {"weigh",
     R"(static @T@ @name@(const @T@ *table, const int32_t *sizes, const int32_t *places, const @T@ *part,
                  int32_t dimensions)
{
    @T@ value[64];
    int32_t corner[64] = {0};
    int32_t corners = 1;
    int32_t stride = 1;
    for (int32_t i = 0; i < dimensions; ++i) {
        for (int32_t c = 0; c < corners; ++c) {
            corner[c] += places[i] * stride;
            corner[c + corners] = (sizes[i] > 1) ? (corner[c] + stride) : corner[c];
        }
        corners *= 2;
        stride *= sizes[i];
    }
    for (int32_t c = 0; c < corners; ++c) {
        value[c] = table[corner[c]];
    }
    for (int32_t i = dimensions - 1; i >= 0; --i) {
        corners /= 2;
        for (int32_t c = 0; c < corners; ++c) {
            const @T@ other = value[c + corners];
            if (part[i] == @one@) {
                value[c] = other;
            } else if (part[i] != @zero@) {
                value[c] = value[c] + (part[i] * (other - value[c]));
            } else {
                // the value of this corner
            }
        }
    }
    return value[0];
}
)"},
    // layout: 0 for the lower point's value, 1 for the nearer one's, 2 for straight lines; whether values are
    // held beyond the ends; the numbers of points; the points.
    {"look_up", R"(static @T@ @name@(const @T@ *layout, const @T@ *table, const @T@ *at, int32_t dimensions)
{
    const bool is_flat = (layout[0] == @zero@);
    const bool is_nearest = (layout[0] == @one@);
    const bool clips = is_flat || is_nearest || (layout[1] != @zero@);
    @T@ part[6] = {0};
    int32_t sizes[6] = {0};
    int32_t places[6] = {0};
    int32_t points = 2 + dimensions;
    for (int32_t i = 0; i < dimensions; ++i) {
        sizes[i] = (int32_t)layout[2 + i];
        places[i] = @piece@(&layout[points], sizes[i], at[i], clips, &part[i]);
        if ((is_flat || is_nearest) && (isnan(part[i]) == 0)) {
            part[i] = (part[i] < (is_flat ? @one@ : @half@)) ? @zero@ : @one@;
        }
        points += sizes[i];
    }
    return @weigh@(table, sizes, places, part, dimensions);
}
)"},
    // Slopes of the cubic spline at its points, by elimination from top to bottom; work holds c / b.
    {"gap", "static @T@ @name@(const @T@ *x, int32_t i)\n{\n    return x[i + 1] - x[i];\n}\n"},
    {"secant", "static @T@ @name@(const @T@ *x, const @T@ *v, int32_t i)\n{\n    return (v[i + 1] - v[i]) / "
               "@gap@(x, i);\n}\n"},
    {"spline_slopes", R"(static void @name@(@T@ *slope, const @T@ *x, const @T@ *v, @T@ *work, int32_t n)
{
    for (int32_t i = 0; (i < n) && (n < 3); ++i) {
        slope[i] = (n == 2) ? @secant@(x, v, 0) : @zero@;
    }
    for (int32_t i = 0; (i < n) && (n >= 3); ++i) {
        @T@ a = @zero@;
        @T@ b = @one@;
        @T@ c = @zero@;
        @T@ r;
        if ((n == 3) && (i != 1)) {
            if (i == 0) {
                c = @one@;
            } else {
                a = @one@;
            }
            r = @two@ * @secant@(x, v, (i == 0) ? 0 : 1);
        } else if (i == 0) {
            const @T@ h = @gap@(x, 0);
            b = @gap@(x, 1);
            c = h + b;
            r = (((h + (@two@ * c)) * b * @secant@(x, v, 0)) + (h * h * @secant@(x, v, 1))) / c;
        } else if (i < (n - 1)) {
            a = @gap@(x, i);
            c = @gap@(x, i - 1);
            b = @two@ * (c + a);
            r = @three@ * ((a * @secant@(x, v, i - 1)) + (c * @secant@(x, v, i)));
        } else {
            const @T@ h = @gap@(x, n - 2);
            b = @gap@(x, n - 3);
            a = b + h;
            r = ((h * h * @secant@(x, v, n - 3)) + (((@two@ * a) + h) * b * @secant@(x, v, n - 2))) / a;
        }
        const @T@ pivot = (i == 0) ? b : (b - (a * work[i - 1]));
        work[i] = c / pivot;
        slope[i] = (i == 0) ? (r / pivot) : ((r - (a * slope[i - 1])) / pivot);
    }
    for (int32_t i = n - 2; (i >= 0) && (n >= 3); --i) {
        slope[i] -= work[i] * slope[i + 1];
    }
}
)"},
    // Slopes of the modified Akima interpolant; secants beyond the ends go on as a parabola does.
    {"secant_beyond", R"(static @T@ @name@(const @T@ *x, const @T@ *v, int32_t n, int32_t i)
{
    const int32_t beyond = i - n + 2;
    @T@ y;
    if (n == 2) {
        y = @secant@(x, v, 0);
    } else if (i < 0) {
        y = @secant@(x, v, 0) + ((@T@)i * (@secant@(x, v, 1) - @secant@(x, v, 0)));
    } else if (beyond > 0) {
        y = @secant@(x, v, n - 2) + ((@T@)beyond * (@secant@(x, v, n - 2) - @secant@(x, v, n - 3)));
    } else {
        y = @secant@(x, v, i);
    }
    return y;
}
)"},
    {"akima_slopes", R"(static void @name@(@T@ *slope, const @T@ *x, const @T@ *v, int32_t n)
{
    if (n == 1) {
        slope[0] = @zero@;
    }
    for (int32_t i = 0; (i < n) && (n > 1); ++i) {
        const @T@ before = @secant_beyond@(x, v, n, i - 2);
        const @T@ left = @secant_beyond@(x, v, n, i - 1);
        const @T@ right = @secant_beyond@(x, v, n, i);
        const @T@ after = @secant_beyond@(x, v, n, i + 1);
        const @T@ a = fabs@f@(after - right) + (fabs@f@(after + right) / @two@);
        const @T@ b = fabs@f@(left - before) + (fabs@f@(left + before) / @two@);
        slope[i] = ((a + b) == @zero@) ? @zero@ : (((a * left) + (b * right)) / (a + b));
    }
}
)"},
    // The cubic through the points with these slopes.
    {"hermite",
     R"(static @T@ @name@(bool clips, const @T@ *x, const @T@ *v, const @T@ *slope, int32_t n, @T@ at)
{
    @T@ y = at;
    if ((n > 1) && (at >= x[0]) && (at <= x[n - 1])) {
        @T@ part;
        const int32_t k = @piece@(x, n, at, false, &part);
        const @T@ h = @gap@(x, k);
        const @T@ t = at - x[k];
        const @T@ m = @secant@(x, v, k);
        const @T@ c = ((@three@ * m) - (@two@ * slope[k]) - slope[k + 1]) / h;
        const @T@ b = (slope[k] + slope[k + 1] - (@two@ * m)) / (h * h);
        y = v[k] + (t * (slope[k] + (t * (c + (t * b)))));
    } else if (isnan(at) == 0) {
        const int32_t end = ((n > 1) && (at > x[n - 1])) ? (n - 1) : 0;
        y = v[end] + (clips ? @zero@ : (slope[end] * (at - x[end])));
    } else {
        // y = at, which is NaN
    }
    return y;
}
)"},
    // The value `delay` before t, from rings of times and values, of which `count` entries were written; not
    // known where the rings hold it no longer.
    {"delayed", R"(static @T@ @name@(@T@ initial, @T@ delay, @T@ t, const @T@ *times, const @T@ *values,
                  uint32_t capacity, uint32_t count, bool *is_known)
{
    const uint32_t held = (count < capacity) ? count : capacity;
    const uint32_t oldest = count - held;
    const @T@ at = t - ((delay > @zero@) ? delay : @zero@);
    @T@ y = initial;
    if ((held == 0U) || (at < times[oldest % capacity])) {
        *is_known = *is_known && ((held == 0U) || (oldest == 0U));
    } else {
        uint32_t low = 0U;
        uint32_t high = held;
        while ((high - low) > 1U) {
            const uint32_t middle = low + ((high - low) / 2U);
            if (times[(oldest + middle) % capacity] <= at) {
                low = middle;
            } else {
                high = middle;
            }
        }
        if (((low + 1U) == held) && (held > 1U)) {
            low--;
        }
        const uint32_t a = (oldest + low) % capacity;
        const uint32_t b = (held > 1U) ? ((oldest + low + 1U) % capacity) : a;
        const @T@ part = (a == b) ? @zero@ : ((at - times[a]) / (times[b] - times[a]));
        y = (part == @one@) ? values[b] : (values[a] + (part * (values[b] - values[a])));
    }
    return y;
}
)"},
    // 1 where it rose, -1 where it fell, else 0.
    {"crossing", R"(static @T@ @name@(@T@ before, @T@ now)
{
    const bool rises = (before < @zero@) && (now >= @zero@);
    const bool falls = (before > @zero@) && (now <= @zero@);
    return rises ? @one@ : (falls ? -@one@ : @zero@);
}
)"},
    // Results that are not finite are not good.
    {"bounded", R"(static @T@ @name@(@T@ x, bool *is_good)
{
    *is_good = *is_good && (isfinite(x) != 0);
    return x;
}
)"},
    {"bounded_multiply", "static @T@ @name@(@T@ a, @T@ b, bool *is_good)\n{\n    return @bounded@(a * b, "
                         "is_good);\n}\n"},
    {"bounded_divide", R"(static @T@ @name@(@T@ a, @T@ b, bool *is_good)
{
    *is_good = *is_good && (b != @zero@);
    return @bounded@(a / b, is_good);
}
)"},
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
        r = @remainder@(x, y);
        if ((r != @zero@) && ((r < @zero@) != (y < @zero@))) {
            r = r + y;
        }
    }
    return r;
}
)"}};

/// Whole numbers wrap around: the low bits of sum, difference and product do not depend on signs.
const CDefinitions of_whole_numbers{
    {"is_index", "static bool @name@(double at, @T@ n)\n{\n    return (at >= 0.0) && (at < (double)n);\n}\n"},
    {"nearest_index", R"(static @T@ @name@(double at, @T@ n)
{
    @T@ k = 0;
    if (at >= (double)n) {
        k = n - 1;
    } else if (at >= 0.0) {
        k = (@T@)at;
    } else {
        // of NaN, too, 0
    }
    return k;
}
)"},
    // Zeros come in from below, the sign from above.
    {"shift", R"(static @T@ @name@(@T@ x, double places)
{
    const double held = (places > 32.0) ? 32.0 : ((places < -32.0) ? -32.0 : places);
    const uint64_t wide = (uint64_t)(int64_t)x;
    const uint32_t distance = (uint32_t)fabs(held);
    uint64_t y;
    if (held >= 0.0) {
        y = wide << distance;
    } else if (wide > (uint64_t)INT64_MAX) {
        y = ~(~wide >> distance);
    } else {
        y = wide >> distance;
    }
    return (@T@)y;
}
)"},
    {"holds", "static bool @name@(double x)\n{\n    return (x >= (double)@min@) && (x < ((double)@max@ + "
              "1.0));\n}\n"},
    {"saturated", R"(static @T@ @name@(double x)
{
    @T@ y = 0;
    if (x >= (double)@max@) {
        y = @max@;
    } else if (x <= (double)@min@) {
        y = @min@;
    } else if (isnan(x) == 0) {
        y = (@T@)x;
    } else {
        // of NaN 0
    }
    return y;
}
)"},
    {"wrapped", R"(static @T@ @name@(double x)
{
    @T@ y = 0;
    if (isfinite(x) != 0) {
        const double part = fmod(x, 4294967296.0);
        const uint32_t bits = (uint32_t)fabs(part);
        const uint32_t low = (part < 0.0) ? (0U - bits) : bits;
        y = (@T@)low;
    }
    return y;
}
)"},
    {"bit_and", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a & (uint32_t)b;\n    "
                "return (@T@)y;\n}\n"},
    {"bit_or", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a | (uint32_t)b;\n    "
               "return (@T@)y;\n}\n"},
    {"bit_xor", "static @T@ @name@(@T@ a, @T@ b)\n{\n    const uint32_t y = (uint32_t)a ^ (uint32_t)b;\n    "
                "return (@T@)y;\n}\n"},
    {"bit_not", "static @T@ @name@(@T@ a)\n{\n    const uint32_t y = ~(uint32_t)a;\n    return "
                "(@T@)y;\n}\n"},
    // Results that leave the type are held at its ends, and are not good.
    {"bounded", R"(static @T@ @name@(int64_t x, bool *is_good)
{
    const int64_t y = (x > (int64_t)@max@) ? (int64_t)@max@ : ((x < (int64_t)@min@) ? (int64_t)@min@ : x);
    *is_good = *is_good && (y == x);
    return (@T@)y;
}
)"},
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

const CDefinitions of_signed{
    {"bounded_multiply",
     "static @T@ @name@(@T@ a, @T@ b, bool *is_good)\n{\n    return @bounded@((int64_t)a * "
     "(int64_t)b, is_good);\n}\n"},
    // The only quotient that is too large is that of the smallest number by -1.
    {"bounded_divide", R"(static @T@ @name@(@T@ a, @T@ b, bool *is_good)
{
    *is_good = *is_good && (b != 0);
    return (b == -1) ? @bounded@(-(int64_t)a, is_good) : @divide@(a, b);
}
)"},
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

const CDefinitions of_unsigned{
    {"bounded_multiply", R"(static @T@ @name@(@T@ a, @T@ b, bool *is_good)
{
    const uint64_t x = (uint64_t)a * (uint64_t)b;
    const bool is_held = (x > (uint64_t)@max@);
    *is_good = *is_good && (!is_held);
    return is_held ? (@T@)@max@ : (@T@)x;
}
)"},
    {"bounded_divide", R"(static @T@ @name@(@T@ a, @T@ b, bool *is_good)
{
    *is_good = *is_good && (b != 0U);
    return @divide@(a, b);
}
)"},
    {"absolute", "static @T@ @name@(@T@ x)\n{\n    return x;\n}\n"},
    {"remainder", "static @T@ @name@(@T@ x, @T@ y)\n{\n    return (y == 0U) ? (@T@)0 : (@T@)(x % y);\n}\n"},
    {"modulo", "static @T@ @name@(@T@ x, @T@ y)\n{\n    return (y == 0U) ? x : (@T@)(x % y);\n}\n"},
    {"divide",
     "static @T@ @name@(@T@ a, @T@ b)\n{\n    return (b == 0U) ? ((a == 0U) ? (@T@)0 : (@T@)@max@) : "
     "(@T@)(a / b);\n}\n"}};

/// Null: there is none.
const std::string* text_of(const CFunction& function) {
    const auto& [name, type] = function;
    const std::array<const CDefinitions*, 3> known =
        is_real(type) ? std::array{&of_all, &of_reals, &c_matrix_definitions()}
                      : std::array{&of_all, &of_whole_numbers, is_signed(type) ? &of_signed : &of_unsigned};
    for (const auto* definitions : known)
        if (const auto found = definitions->find(name); found != definitions->end()) return &found->second;
    return nullptr;
}

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

std::vector<CFunction> c_needs(const CFunction& function) {
    std::vector<CFunction> needs;
    const std::string* const text = text_of(function);
    for (std::size_t at = 0; text && (at = text->find('@', at)) != text->npos;) {
        const auto end = text->find('@', at + 1);
        const CFunction needed{text->substr(at + 1, end - at - 1), function.second};
        if (text_of(needed)) needs.push_back(needed);
        at = end + 1;
    }
    return needs;
}

std::string c_definition(const CFunction& function, const std::string& prefix) {
    const auto& [name, type] = function;
    if (is_real(type) && library.contains(name)) return {};
    std::string upper = enumerator(type);
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    Marks marks{{"@T@", c_name(type)},
                {"@name@", c_name(function, prefix)},
                {"@f@", type == Type::float32 ? "f" : ""},
                {"@zero@", literal(0, type)},
                {"@one@", literal(1, type)},
                {"@two@", literal(2, type)},
                {"@three@", literal(3, type)},
                {"@half@", is_real(type) ? literal(0.5, type) : ""},
                {"@draw@", type == Type::float32
                               ? "const uint32_t high = word[0] >> 8U;\n    return (float)high / 16777216.0F;"
                               : "const uint32_t high = word[0] >> 5U;\n    const uint32_t low = word[1] >> "
                                 "6U;\n    return (((double)high * 67108864.0) + (double)low) / "
                                 "9007199254740992.0;"},
                {"@ten@", literal(10, type)},
                {"@pi@", literal(std::acos(-1.0), type)},
                {"@half_turn@", literal(180, type)},
                {"@epsilon@", type == Type::float32 ? "FLT_EPSILON" : "DBL_EPSILON"},
                {"@largest@", type == Type::float32 ? "FLT_MAX" : "DBL_MAX"},
                {"@max@", upper + "_MAX"},
                {"@min@", is_signed(type) ? upper + "_MIN" : "0"}};
    for (const auto& needed : c_needs(function)) marks["@" + needed.first + "@"] = c_name(needed, prefix);
    if (const std::string* const text = text_of(function)) return filled(*text, marks);
    throw GenerationError("internal error: '" + name + "' has no definition in C");
}

} // namespace bf::codegen
